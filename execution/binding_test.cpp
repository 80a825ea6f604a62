#include "execution/binding.h"

#include <gtest/gtest.h>

namespace rasterbench {
namespace {

/// A worker that was seen on `cpus`, one after the other.
Sightings seen_on(std::vector<int> cpus) {
  Sightings seen;
  seen.first = cpus.front();
  seen.last = cpus.back();
  seen.cpus = std::move(cpus);
  return seen;
}

/// Four cores of two CPUs each.
Binding four_cores(bool spread) { return {.places = {{0, 4}, {1, 5}, {2, 6}, {3, 7}}, .spread = spread}; }

TEST(PlaceOfWorker, CloseFillsNeighbours) {
  for (int worker = 0; worker < 3; ++worker) EXPECT_EQ(place_of_worker(worker, 3, 8, false), worker);
}

TEST(PlaceOfWorker, SpreadTakesTheFirstOfEachRun) {
  EXPECT_EQ(place_of_worker(0, 2, 8, true), 0);
  EXPECT_EQ(place_of_worker(1, 2, 8, true), 4);
  EXPECT_EQ(place_of_worker(2, 3, 8, true), 5);
}

TEST(PlaceOfWorker, MoreThreadsThanPlacesShareThemEvenly) {
  for (const bool spread : {false, true})
    for (int worker = 0; worker < 6; ++worker)
      EXPECT_EQ(place_of_worker(worker, 6, 3, spread), worker / 2) << spread << worker;
}

TEST(BrokenBinding, SiblingsOfOnePlaceAreOnePlace) {
  EXPECT_EQ(broken_binding(std::vector{seen_on({0, 4, 0}), seen_on({5})}, four_cores(false)), "");
}

TEST(BrokenBinding, AWorkerThatLeftItsPlace) {
  const std::string broken = broken_binding(std::vector{seen_on({0}), seen_on({1, 2})}, four_cores(false));
  EXPECT_NE(broken.find("thread 1 left its place: it was seen on CPUs 1 and 2"), std::string::npos) << broken;
}

TEST(BrokenBinding, AWorkerOutsideOfAllPlaces) {
  const std::string broken = broken_binding(std::vector{seen_on({9})}, four_cores(false));
  EXPECT_NE(broken.find("CPU 9"), std::string::npos) << broken;
}

TEST(BrokenBinding, TwoWorkersInOnePlace) {
  for (const bool spread : {false, true}) {
    const std::string broken = broken_binding(std::vector{seen_on({1}), seen_on({5})}, four_cores(spread));
    EXPECT_NE(broken.find("threads 0 and 1"), std::string::npos) << broken;
  }
}

TEST(BrokenBinding, NoPlaceIsSharedByRightWhereThreadsAreMore) {
  const std::vector many{seen_on({0}), seen_on({4}), seen_on({1}), seen_on({2}), seen_on({3})};
  EXPECT_EQ(broken_binding(many, four_cores(false)), "");
}

TEST(BrokenBinding, SpreadThatIsNotSpread) {
  const std::vector neighbours{seen_on({0}), seen_on({1})}, spread{seen_on({0}), seen_on({2})};
  EXPECT_EQ(broken_binding(neighbours, four_cores(false)), "");
  EXPECT_EQ(broken_binding(spread, four_cores(true)), "");
  EXPECT_NE(broken_binding(neighbours, four_cores(true)), "");
  EXPECT_NE(broken_binding(spread, four_cores(false)), "");
}

TEST(BrokenBinding, PlacesCountFromThatOfThreadZero) {
  EXPECT_EQ(broken_binding(std::vector{seen_on({3}), seen_on({0})}, four_cores(false)), "");
  EXPECT_EQ(broken_binding(std::vector{seen_on({2}), seen_on({0})}, four_cores(true)), "");
}

TEST(BrokenBinding, WhoWasNeverSeenContradictsNothing) {
  EXPECT_EQ(broken_binding(std::vector{seen_on({0}), Sightings{}}, four_cores(false)), "");
}

TEST(Sightings, NoteEachCpuOnceAndEveryMove) {
  Sightings seen;
  seen.look();
  const int cpu = seen.first;
  EXPECT_GE(cpu, 0);
  EXPECT_EQ(seen.moves, 0);
  seen.last = cpu + 1000;  // as if it had been seen elsewhere since
  seen.cpus.push_back(cpu + 1000);
  seen.look();
  EXPECT_EQ(seen.moves, 1);
  EXPECT_LT(seen.last, cpu + 1000);
}

}  // namespace
}  // namespace rasterbench
