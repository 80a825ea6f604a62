// A correct picture spoiled in one way, chosen by FAULT when this is compiled.
#include <omp.h>

#include <csignal>
#include <utility>

#include "course_program.h"

int main(int, char** argv) {
  course::Job job = course::read_job(argv[1], argv[2]);
  const int fault = FAULT;
  if (fault == 1 && omp_get_max_threads() > 1) std::raise(SIGSEGV);  // crashes with threads only
  if (fault == 2)                                                    // the farthest triangle wins
    for (course::Screen& t : job.triangles)
      for (double& d : t.d) d = -d;
  if (fault == 3)  // another shading
    for (course::Screen& t : job.triangles)
      t.colour.r = static_cast<unsigned char>(std::min(255, t.colour.r + 9));
  if (fault == 7)  // samples at the corners of pixels
    for (course::Screen& t : job.triangles)
      for (int i = 0; i < 3; ++i) t.x[i] += 0.5, t.y[i] += 0.5;
  course::Image image(job);
  for (int y = 0; y < job.height; ++y) course::draw_row(job, image, y);
  if (fault == 4)  // upside down
    for (int y = 0; y < job.height / 2; ++y)
      for (int x = 0; x < job.width; ++x)
        std::swap(image.colours[image.at(x, y)], image.colours[image.at(x, job.height - 1 - y)]);
  if (fault == 5)  // a tile that nobody wrote
    for (int y = 8; y < 16; ++y)
      for (int x = 40; x < 48; ++x) image.colours[image.at(x, y)] = {0, 0, 0};
  if (fault == 6)  // blank: the row whose number is that of the threads
    for (int x = 0; x < job.width; ++x) image.colours[image.at(x, omp_get_max_threads())] = job.background;
  course::write_ppm(argv[3], job, image);
}
