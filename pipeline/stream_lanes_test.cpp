// What is streamed arrives, whatever its alignment and length, and nothing beside it changes.
#include "pipeline/stream_lanes.h"

#include <gtest/gtest.h>

#include <bit>
#include <vector>

namespace rasterbench {
namespace {

TEST(StreamLanes, CopyAnyLengthToAnyPlace) {
  constexpr std::size_t kRoom = 300;
  std::vector<std::uint32_t> colours(kRoom);
  std::vector<float> depths(kRoom);
  for (std::size_t i = 0; i < kRoom; ++i) {
    colours[i] = static_cast<std::uint32_t>(i) * 2654435761u;
    depths[i] = std::bit_cast<float>(0x7fc00000u + static_cast<std::uint32_t>(i));  // NaNs keep their bits
  }
  for (const Isa isa : all_isas()) {
    if (!is_supported(isa)) continue;
    for (std::size_t offset = 0; offset < 17; ++offset)
      for (const std::size_t n : {0, 1, 3, 15, 16, 17, 40, 256}) {
        std::vector<std::uint32_t> to_colours(kRoom, 7);
        std::vector<float> to_depths(kRoom, 7);
        // The two need not be aligned alike.
        const std::size_t depth_offset = (offset * 5 + 1) % 17;
        stream_pixels(colours.data() + 1, depths.data() + 2, n, to_colours.data() + offset,
                      to_depths.data() + depth_offset, isa);
        flush_streams();
        for (std::size_t i = 0; i < kRoom; ++i) {
          const bool colour_is_new = i >= offset && i < offset + n;
          ASSERT_EQ(to_colours[i], colour_is_new ? colours[i - offset + 1] : 7u) << to_string(isa) << i;
          const bool depth_is_new = i >= depth_offset && i < depth_offset + n;
          ASSERT_EQ(std::bit_cast<std::uint32_t>(to_depths[i]),
                    std::bit_cast<std::uint32_t>(depth_is_new ? depths[i - depth_offset + 2] : 7.0f))
              << to_string(isa) << i;
        }
      }
  }
}

}  // namespace
}  // namespace rasterbench
