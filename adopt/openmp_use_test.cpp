#include "adopt/openmp_use.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "scene/test_folder.h"

namespace rasterbench {
namespace {

const ProgramFile kStatic{"static ELF", {}};

ProgramFile importing(std::vector<std::string> names) { return {"dynamic ELF", std::move(names)}; }

TEST(OpenMpUse, CallsComeFirst) {
  // The file imports the loop, but what ran was another one.
  const OpenMpUse use = decide_schedule_use(importing({"GOMP_parallel_loop_maybe_nonmonotonic_runtime"}),
                                            {{"regions", 1}, {"loops_dynamic", 2}});
  EXPECT_EQ(use.use, ScheduleUse::kFixed);
  EXPECT_EQ(use.evidence, "calls");
  EXPECT_NE(use.text.find("dynamic"), std::string::npos);
  EXPECT_EQ(decide_schedule_use(kStatic, {{"loops_runtime", 2}, {"loops_static", 2}}).use,
            ScheduleUse::kRuntime);
  EXPECT_EQ(decide_schedule_use(importing({"GOMP_parallel"}), {{"regions", 1}}).use, ScheduleUse::kFixed);
}

TEST(OpenMpUse, ImportsWithoutCalls) {
  const ProbeCounts silent{{"regions", 0}, {"loops_runtime", 0}};
  EXPECT_EQ(decide_schedule_use(importing({"GOMP_loop_runtime_start"}), silent).use, ScheduleUse::kRuntime);
  EXPECT_EQ(decide_schedule_use(importing({"GOMP_parallel"}), {}).use, ScheduleUse::kFixed);
  EXPECT_EQ(decide_schedule_use(importing({"__kmpc_dispatch_init_4", "__kmpc_fork_call"}), {}).use,
            ScheduleUse::kUndecided);
  EXPECT_EQ(decide_schedule_use(importing({"printf"}), silent).use, ScheduleUse::kNoOpenMp);
  EXPECT_NE(decide_schedule_use(importing({"pthread_create"}), {}).text.find("threads itself"),
            std::string::npos);
}

TEST(OpenMpUse, NothingIsKnownOfOtherFiles) {
  for (const char* kind : {"static ELF", "script", "other"})
    EXPECT_EQ(decide_schedule_use({kind, {}}, {}).use, ScheduleUse::kUndecided) << kind;
}

TEST(InspectProgram, Kinds) {
  const TestFolder folder;
  EXPECT_EQ(inspect_program(folder.file("a", "#!/bin/sh\n")).kind, "script");
  EXPECT_EQ(inspect_program(folder.file("b", "hello")).kind, "other");
  EXPECT_EQ(inspect_program(folder.file("c", "\177ELF")).kind, "other");
  EXPECT_EQ(inspect_program(folder / "none").kind, "other");
}

TEST(InspectProgram, ThisTestImportsItsLibraries) {
  const ProgramFile file = inspect_program("/proc/self/exe");
  EXPECT_EQ(file.kind, "dynamic ELF");
  EXPECT_TRUE(std::binary_search(file.imports.begin(), file.imports.end(), "vfork"));
}

TEST(InspectProgram, DamagedFilesAreReadWithoutHarm) {
  const TestFolder folder;
  const std::string whole = read_bytes("/proc/self/exe").substr(0, 1 << 20);
  for (const std::size_t size : {20u, 63u, 64u, 4096u, 100000u})
    EXPECT_NE(inspect_program(folder.file("cut", whole.substr(0, size))).kind, "dynamic ELF");
  for (std::size_t at = 16; at < 64; ++at) {  // every byte of the header
    std::string bytes = whole;
    bytes[at] = static_cast<char>(~bytes[at]);
    inspect_program(folder.file("damaged", bytes));
  }
}

TEST(Probe, ProcessesAreAdded) {
  const TestFolder folder;
  EXPECT_EQ(read_probe(folder.file("x", "regions 2\nlocks 1\nregions 3\n")),
            (ProbeCounts{{"locks", 1}, {"regions", 5}}));
  EXPECT_TRUE(read_probe(folder / "none").empty());
}

}  // namespace
}  // namespace rasterbench
