// What the test programs share: a plain program of the course contract in double precision, written from its
// formulas alone. It clips nothing: its scenes lie in front of the camera. A program includes this and says
// how it draws.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace course {

struct Rgb {
  unsigned char r, g, b;
};

struct Screen {
  double x[3], y[3], d[3];
  Rgb colour;
  int x0, y0, x1, y1;  // pixels that it may cover, the last ones excluded
};

struct Job {
  int width = 0, height = 0;
  Rgb background{};
  std::vector<Screen> triangles;
};

inline std::FILE* opened(const char* name, const char* mode) {
  std::FILE* file = std::fopen(name, mode);
  if (file == nullptr) {
    std::perror(name);
    std::exit(3);
  }
  return file;
}

/// Reads the model and the scene, moves the triangles to the screen and shades them.
inline Job read_job(const char* model, const char* scene) {
  Job job;
  int o[3], b[3];
  double m[3], theta, near_plane, far_plane;
  std::FILE* file = opened(scene, "r");
  if (std::fscanf(file, "%d %d %d %d %d %d %lf %lf %lf %d %d %lf %lf %lf", &o[0], &o[1], &o[2], &b[0], &b[1],
                  &b[2], &m[0], &m[1], &m[2], &job.height, &job.width, &theta, &near_plane, &far_plane) != 14)
    std::exit(4);
  std::fclose(file);
  job.background = {static_cast<unsigned char>(b[0]), static_cast<unsigned char>(b[1]),
                    static_cast<unsigned char>(b[2])};
  const double distance = std::sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]), ground = std::hypot(m[0], m[2]);
  const double u[3] = {m[2] / ground, 0, -m[0] / ground};
  const double v[3] = {-m[0] * m[1] / (ground * distance), ground / distance,
                       -m[1] * m[2] / (ground * distance)};
  const double w[3] = {m[0] / distance, m[1] / distance, m[2] / distance};
  const double sy = 1 / std::tan(theta / 2), sx = sy / (static_cast<double>(job.width) / job.height);

  file = opened(model, "rb");
  std::int32_t count = 0;
  if (std::fread(&count, sizeof count, 1, file) != 1) std::exit(4);
  for (std::int32_t i = 0; i < count; ++i) {
    std::array<float, 9> p;
    if (std::fread(p.data(), sizeof p, 1, file) != 1) std::exit(4);
    Screen t{};
    for (int corner = 0; corner < 3; ++corner) {
      double q[3], view[3] = {0, 0, 0};
      for (int k = 0; k < 3; ++k) {
        q[k] = static_cast<double>(p[static_cast<std::size_t>(3 * corner + k)]) - m[k];
        view[0] += q[k] * u[k], view[1] += q[k] * v[k], view[2] += q[k] * w[k];
      }
      t.x[corner] = (sx * view[0] / -view[2] + 1) * job.width / 2;
      t.y[corner] = (1 - sy * view[1] / -view[2]) * job.height / 2;
      t.d[corner] = ((near_plane + far_plane) / (near_plane - far_plane) * view[2] +
                     2 * near_plane * far_plane / (near_plane - far_plane)) /
                    -view[2];
    }
    double ab[3], ac[3];
    for (std::size_t k = 0; k < 3; ++k) {
      ab[k] = static_cast<double>(p[3 + k]) - static_cast<double>(p[k]);
      ac[k] = static_cast<double>(p[6 + k]) - static_cast<double>(p[k]);
    }
    const double n[3] = {ab[1] * ac[2] - ab[2] * ac[1], ab[2] * ac[0] - ab[0] * ac[2],
                         ab[0] * ac[1] - ab[1] * ac[0]};
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const double s = length > 0 ? std::max(0.0, (n[0] + n[1] + n[2]) / (length * std::sqrt(3.0))) : 0;
    t.colour = {static_cast<unsigned char>(s * o[0]), static_cast<unsigned char>(s * o[1]),
                static_cast<unsigned char>(s * o[2])};
    const auto clamped = [](double value, int most) {
      return static_cast<int>(std::clamp(value, 0.0, most * 1.0));
    };
    t.x0 = clamped(std::floor(std::min({t.x[0], t.x[1], t.x[2]})), job.width);
    t.y0 = clamped(std::floor(std::min({t.y[0], t.y[1], t.y[2]})), job.height);
    t.x1 = clamped(std::ceil(std::max({t.x[0], t.x[1], t.x[2]})), job.width);
    t.y1 = clamped(std::ceil(std::max({t.y[0], t.y[1], t.y[2]})), job.height);
    job.triangles.push_back(t);
  }
  std::fclose(file);
  return job;
}

/// Depth of the triangle at the centre of pixel (x, y), or 2 where it does not cover it.
inline double depth_at(const Screen& t, int x, int y) {
  const double px = x + 0.5, py = y + 0.5;
  double e[3];
  for (int i = 0; i < 3; ++i) {
    const int a = (i + 1) % 3, b = (i + 2) % 3;
    e[i] = (t.x[b] - t.x[a]) * (py - t.y[a]) - (t.y[b] - t.y[a]) * (px - t.x[a]);
  }
  const double area = e[0] + e[1] + e[2];
  if (area == 0) return 2;
  for (double& value : e) value /= area;
#ifdef OPEN_EDGES  // not the contract's fill rule: a sample on an edge belongs to nobody
  if (e[0] <= 0 || e[1] <= 0 || e[2] <= 0) return 2;
#else
  if (e[0] < 0 || e[1] < 0 || e[2] < 0) return 2;
#endif
  return e[0] * t.d[0] + e[1] * t.d[1] + e[2] * t.d[2];
}

/// The pixels and their depths, cleared.
struct Image {
  explicit Image(const Job& job)
      : width(job.width),
        colours(static_cast<std::size_t>(job.width) * static_cast<std::size_t>(job.height), job.background),
        depths(colours.size(), 1.0) {}
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  }
  int width;
  std::vector<Rgb> colours;
  std::vector<double> depths;
};

inline void write_ppm(const char* name, const Job& job, const Image& image) {
  std::FILE* file = opened(name, "wb");
  std::fprintf(file, "P6\n%d %d\n255\n", job.width, job.height);
  std::fwrite(image.colours.data(), sizeof(Rgb), image.colours.size(), file);
  std::fclose(file);
}

/// One row of the image from all triangles: rows are independent, so threads share nothing.
inline void draw_row(const Job& job, Image& image, int y) {
  for (const Screen& t : job.triangles) {
    if (y < t.y0 || y >= t.y1) continue;
    for (int x = t.x0; x < t.x1; ++x) {
      const double d = depth_at(t, x, y);
      const std::size_t pixel = image.at(x, y);
      if (d < image.depths[pixel]) {
        image.depths[pixel] = d;
        image.colours[pixel] = t.colour;
      }
    }
  }
}

}  // namespace course
