#include "adopt/run_program.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "scene/test_folder.h"

namespace rasterbench {
namespace {

ProgramRun shell(const std::string& script) {
  return {.words = {"/bin/sh", "-c", script}, .folder = "/", .limit_seconds = 20};
}

TEST(RunProgram, EndsAndSpeaks) {
  const ProgramResult result = run_program(shell("echo out; echo err >&2; exit 3"));
  EXPECT_EQ(result.end, RunEnd::kExited);
  EXPECT_EQ(result.code, 3);
  EXPECT_EQ(result.output, "out\nerr\n");
  EXPECT_GT(result.seconds, 0);
  EXPECT_EQ(result.max_rss_bytes, 0);
}

TEST(RunProgram, Signals) {
  const ProgramResult result = run_program(shell("kill -SEGV $$"));
  EXPECT_EQ(result.end, RunEnd::kSignalled);
  EXPECT_EQ(result.code, SIGSEGV);
  EXPECT_NE(describe_end(shell(""), result).find("signal 11"), std::string::npos);
}

TEST(RunProgram, CannotBeStarted) {
  ProgramRun run = shell("");
  run.words = {"/no/such/program"};
  const ProgramResult result = run_program(run);
  EXPECT_EQ(result.end, RunEnd::kNotStarted);
  EXPECT_NE(describe_end(run, result).find("No such file"), std::string::npos);
}

TEST(RunProgram, TheWholeGroupDiesAtTheLimit) {
  const TestFolder folder;
  ProgramRun run = shell("sleep 60 & echo $! > " + (folder / "pid").string() + "; wait");
  run.limit_seconds = 0.3;
  const ProgramResult result = run_program(run);
  EXPECT_EQ(result.end, RunEnd::kTimeLimit);
  EXPECT_LT(result.seconds, 10);
  const int child = std::atoi(read_bytes(folder / "pid").c_str());
  ASSERT_GT(child, 0);
  for (int i = 0; i < 100 && kill(child, 0) == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  // Dead, or a zombie that nobody has reaped yet.
  const std::string state = read_bytes("/proc/" + std::to_string(child) + "/stat");
  EXPECT_TRUE(state.empty() || state.find(") Z") != std::string::npos) << state;
}

TEST(RunProgram, WhatItLeavesBehindDoesNotHoldItUp) {
  const ProgramResult result = run_program(shell("sleep 60 & echo done"));  // which keeps the pipe open
  EXPECT_EQ(result.end, RunEnd::kExited);
  EXPECT_LT(result.seconds, 10);
  EXPECT_EQ(result.output, "done\n");
}

TEST(RunProgram, Stops) {
  ProgramRun run = shell("sleep 60");
  run.stop = [] { return true; };
  EXPECT_EQ(run_program(run).end, RunEnd::kStopped);
}

TEST(RunProgram, KeepsTheEndOfALongSpeech) {
  const ProgramResult result = run_program(shell("yes | head -c 3000000; echo end"));
  EXPECT_EQ(result.end, RunEnd::kExited);
  EXPECT_LE(result.output.size(), kOutputBytes);
  EXPECT_TRUE(result.output.ends_with("end\n"));
}

TEST(RunProgram, FilesHaveALimit) {
  const TestFolder folder;
  ProgramRun run = shell("exec head -c 1000000 /dev/zero > big");
  run.folder = folder / "";
  run.max_file_bytes = 1000;
  const ProgramResult result = run_program(run);
  EXPECT_TRUE(result.end == RunEnd::kSignalled || result.code != 0);
  EXPECT_LE(std::filesystem::file_size(folder / "big"), 1000u);
}

TEST(RunProgram, TheEnvironmentIsSaid) {
  setenv("OMP_SCHEDULE", "guided", 1);
  setenv("RASTERBENCH_TEST_KEPT", "kept", 1);
  ProgramRun run = shell("echo $OMP_SCHEDULE,$OMP_NUM_THREADS,$RASTERBENCH_TEST_KEPT");
  run.variables = {{"OMP_NUM_THREADS", "3"}};
  EXPECT_EQ(run_program(run).output, ",3,kept\n");
  unsetenv("OMP_SCHEDULE");
  unsetenv("RASTERBENCH_TEST_KEPT");
}

TEST(RunProgram, Watches) {
  ProgramRun run = shell("exec sleep 0.3");
  run.watch = true;
  const std::vector<char> own(200 << 20, 'x');  // not to be mistaken for the program's
  const ProgramResult result = run_program(run);
  EXPECT_EQ(own.back(), 'x');
  EXPECT_EQ(result.most_threads, 1);
  EXPECT_GT(result.max_rss_bytes, 100000);
  EXPECT_LT(result.max_rss_bytes, 50 << 20);
}

TEST(RunProgram, NothingToRead) { EXPECT_EQ(run_program(shell("cat; echo end")).output, "end\n"); }

}  // namespace
}  // namespace rasterbench
