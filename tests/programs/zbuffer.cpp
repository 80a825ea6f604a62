// Triangles in parallel into one z-buffer. Without GUARDED: a data race between the test of a depth and its
// write. With it: one critical section for all pixels, so that threads take turns and nothing is gained.
#include "course_program.h"

int main(int, char** argv) {
  const course::Job job = course::read_job(argv[1], argv[2]);
  course::Image image(job);
  const int count = static_cast<int>(job.triangles.size());
#pragma omp parallel for schedule(runtime)
  for (int i = 0; i < count; ++i) {
    const course::Screen& t = job.triangles[static_cast<std::size_t>(i)];
    for (int y = t.y0; y < t.y1; ++y)
      for (int x = t.x0; x < t.x1; ++x) {
        const std::size_t pixel = image.at(x, y);
#ifdef GUARDED
#pragma omp critical
#endif
        {
          const double d = course::depth_at(t, x, y);
          if (d < image.depths[pixel]) {
            image.depths[pixel] = d;
            image.colours[pixel] = t.colour;
          }
        }
      }
  }
  course::write_ppm(argv[3], job, image);
}
