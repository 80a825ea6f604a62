// Errors, suggestions, memory and function references.
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/buffer.h"
#include "base/error.h"
#include "base/function_ref.h"
#include "base/suggest.h"

namespace rasterbench {
namespace {

TEST(InputErrors, SayWhere) {
  EXPECT_STREQ(InputError({.file = "a.txt", .line = 3, .field = "theta"}, "must be positive").what(),
               "a.txt:3: theta: must be positive");
  EXPECT_STREQ(InputError({.file = "a.dat", .byte = 0}, "too short").what(), "a.dat: byte 0: too short");
  EXPECT_STREQ(InputError({.file = "a.dat", .byte = 40, .field = "T"}, "too large").what(),
               "a.dat: byte 40: T: too large");
  EXPECT_STREQ(InputError({.file = "a.txt"}, "not found").what(), "a.txt: not found");
  EXPECT_STREQ(InputError({.field = "chunk"}, "must be at least 1").what(), "chunk: must be at least 1");
  EXPECT_STREQ(InputError("no").what(), "no");
  EXPECT_STREQ(InputError(Place{}, "no").what(), "no");
}

TEST(InputErrors, ExitWithTwoAndOthersWithOne) {
  const InputError input("bad");
  const Error other("bad");
  EXPECT_EQ(static_cast<const Error&>(input).exit_code(), 2);
  EXPECT_EQ(other.exit_code(), 1);
}

TEST(Suggestions, NameTheNearest) {
  const std::vector<std::string> known{"static", "dynamic", "guided", "auto"};
  EXPECT_EQ(unknown_name("schedule", "dynamc", known), "unknown schedule 'dynamc'; did you mean 'dynamic'?");
  EXPECT_EQ(unknown_name("schedule", "Static", known), "unknown schedule 'Static'; did you mean 'static'?");
  EXPECT_EQ(unknown_name("schedule", "guideed", known), "unknown schedule 'guideed'; did you mean 'guided'?");
  EXPECT_EQ(unknown_name("schedule", "uato", known), "unknown schedule 'uato'; did you mean 'auto'?");
  // The beginning of a name is enough, however much is missing.
  EXPECT_EQ(unknown_name("kernel", "tr", std::vector<std::string>{"row_parallel", "triangle_locks"}),
            "unknown kernel 'tr'; did you mean 'triangle_locks'?");
}

TEST(Suggestions, PreferTheNearerName) {
  const std::vector<std::string> known{"tile_parallel", "row_parallel"};
  EXPECT_EQ(unknown_name("kernel", "row_paralel", known),
            "unknown kernel 'row_paralel'; did you mean 'row_parallel'?");
}

TEST(Suggestions, PreferTheFirstOfEquallyNearNames) {
  EXPECT_EQ(unknown_name("mode", "fixed_7", std::vector<std::string>{"fixed_8", "fixed_4"}),
            "unknown mode 'fixed_7'; did you mean 'fixed_8'?");
}

TEST(Suggestions, ListAllWhereNoneIsNear) {
  EXPECT_EQ(unknown_name("mode", "abc", std::vector<std::string>{"f32"}), "unknown mode 'abc'; known: f32");
  EXPECT_EQ(unknown_name("schedule", "fibonacci", std::vector<std::string>{"static", "auto"}),
            "unknown schedule 'fibonacci'; known: static, auto");
  EXPECT_EQ(unknown_name("schedule", "", std::vector<std::string>{"static", "auto"}),
            "unknown schedule ''; known: static, auto");
}

/// what() of the InputError that `call` throws; empty if it throws none.
template <class Call>
std::string input_error(Call call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(CheckedBytes, MultipliesWhatFits) {
  EXPECT_EQ(checked_bytes(1000, 36, "triangles"), 36000u);
  EXPECT_EQ(checked_bytes(0, 8, "nothing"), 0u);
}

TEST(CheckedBytes, RefusesWhatDoesNotFitAndNamesBothSizes) {
  // 2^50 * 8 bytes = 2^23 GiB.
  const std::string too_much =
      input_error([] { checked_bytes(std::size_t{1} << 50, 8, "the depth buffer"); });
  EXPECT_TRUE(too_much.starts_with("the depth buffer needs 8388608.0 GiB of memory, ")) << too_much;
  EXPECT_TRUE(too_much.ends_with(" GiB are available")) << too_much;
  // 2^62 * 4 is 0 in 64 bits: an unchecked product would be granted.
  const std::string overflow = input_error([] { checked_bytes(std::size_t{1} << 62, 4, "the image"); });
  EXPECT_TRUE(overflow.starts_with("the image needs 17179869184.0 GiB of memory, ")) << overflow;
}

TEST(CheckedBytes, KnowsTheMachine) {
  EXPECT_GT(available_memory(), std::size_t{1} << 20);
  EXPECT_LT(available_memory(), std::size_t{1} << 50);
}

TEST(Buffers, AreZeroAndPageAligned) {
  const Buffer<std::uint64_t> buffer(100000, "a buffer");
  ASSERT_EQ(buffer.size(), 100000u);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(buffer.data()) % 4096, 0u);
  for (const std::uint64_t value : buffer.span()) ASSERT_EQ(value, 0u);
}

TEST(Buffers, MayBeEmpty) {
  Buffer<int> none;
  Buffer<int> zero(0, "nothing");
  EXPECT_EQ(none.size(), 0u);
  EXPECT_EQ(zero.data(), nullptr);
  EXPECT_TRUE(zero.span().empty());
}

TEST(Buffers, MoveTheirPages) {
  Buffer<int> source(10, "source");
  source[7] = 42;
  const int* pages = source.data();
  Buffer<int> moved(std::move(source));
  EXPECT_EQ(moved.data(), pages);
  EXPECT_EQ(moved.size(), 10u);
  EXPECT_EQ(moved[7], 42);
  EXPECT_EQ(source.data(), nullptr);  // NOLINT(bugprone-use-after-move): what it must look like
  EXPECT_EQ(source.size(), 0u);
  Buffer<int> assigned(20, "assigned");
  assigned = std::move(moved);
  EXPECT_EQ(assigned.data(), pages);
  EXPECT_EQ(assigned.size(), 10u);
  EXPECT_EQ(assigned[7], 42);
}

TEST(Buffers, RequireGrowsAndNeverShrinks) {
  Buffer<int> buffer(10, "buffer");
  buffer[3] = 1;
  const int* pages = buffer.data();
  buffer.require(5, "buffer");
  buffer.require(10, "buffer");
  EXPECT_EQ(buffer.data(), pages);
  EXPECT_EQ(buffer.size(), 10u);
  EXPECT_EQ(buffer[3], 1);
  buffer.require(100000, "buffer");
  ASSERT_EQ(buffer.size(), 100000u);
  EXPECT_EQ(buffer[3], 0);  // new pages
  buffer[99999] = 1;
}

TEST(Buffers, ThatDoNotFitThrowAndStayAsTheyWere) {
  Buffer<int> buffer(10, "buffer");
  buffer[3] = 1;
  const std::string message =
      input_error([&] { buffer.require(std::numeric_limits<std::size_t>::max() / 2, "the pixels"); });
  EXPECT_TRUE(message.starts_with("the pixels needs ")) << message;
  EXPECT_EQ(buffer.size(), 10u);
  EXPECT_EQ(buffer[3], 1);
}

TEST(Buffers, OfHugePagesBeginOnOne) {
  constexpr std::size_t kHugePage = std::size_t{2} << 20;
  for (const std::size_t bytes : {kHugePage, kHugePage + 1, 5 * kHugePage - 4096}) {
    Buffer<char> buffer(bytes, "a buffer", Pages::kHuge);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(buffer.data()) % kHugePage, 0u);
    buffer[0] = 'a';
    buffer[bytes - 1] = 'z';
    EXPECT_EQ(buffer[bytes / 2], 0);
  }
  Buffer<char> small(100, "a small one", Pages::kHuge);
  small[99] = 'z';
  EXPECT_EQ(small[98], 0);
}

TEST(FunctionRefs, CallWhatTheyWereMadeOf) {
  int sum = 0;
  auto add = [&sum](int value) { return sum += value; };
  const FunctionRef<int(int)> to_lambda(add);
  EXPECT_EQ(to_lambda(3), 3);
  EXPECT_EQ(to_lambda(4), 7);
  EXPECT_EQ(sum, 7);

  const auto square = [](int value) {
    return value * value;
  };  // const: the cast away of const must come back
  EXPECT_EQ((FunctionRef<int(int)>(square))(5), 25);
}

TEST(FunctionRefs, ReferToStateAndAreCopiedWithoutIt) {
  int count = 0;
  auto counter = [count]() mutable { return ++count; };
  const FunctionRef<int()> first(counter);
  const FunctionRef<int()> second = first;  // refers to the lambda, not to `first`
  EXPECT_EQ(first(), 1);
  EXPECT_EQ(second(), 2);
  EXPECT_EQ(counter(), 3);
}

TEST(FunctionRefs, PassArgumentsOn) {
  std::string joined;
  const auto join = [&](const std::string& a, std::string&& b) { joined = a + std::move(b); };
  const auto call = [](FunctionRef<void(const std::string&, std::string&&)> f) { f("a", "b"); };
  call(join);
  EXPECT_EQ(joined, "ab");
}

}  // namespace
}  // namespace rasterbench
