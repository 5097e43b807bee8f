// Finds bodies with a flag among many without.
#include "native/flag_scan.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "random.hpp"

namespace fathom::native::flag_scan_test {
namespace {

std::vector<std::size_t> found(std::uint8_t mask, std::span<const std::uint8_t> flags) {
  std::vector<std::size_t> slots;
  for_each_eight_with(mask, flags, [&](std::size_t slot, std::uint64_t eight) {
    EXPECT_EQ(slot % 8, 0u);
    EXPECT_NE(eight, 0u);
    for (std::size_t k = 0; k < 8; ++k)
      if (const auto of_one = static_cast<std::uint8_t>(eight >> 8 * k); of_one != 0) {
        slots.push_back(slot + k);
        EXPECT_EQ(of_one, flags[slot + k] & mask);
      }
  });
  return slots;
}

TEST(FlagScan, FindsEveryBodyWithTheFlagAndNoOther) {
  test::Generator random(1);
  for (const unsigned one_in : {1u, 5u, 100u, 1000u})
    for (std::size_t count = 0; count < 300; ++count) {
      constexpr std::uint8_t mask = 0x12;
      std::vector<std::uint8_t> flags(count);
      std::vector<std::size_t> expected;
      for (std::size_t slot = 0; slot < count; ++slot) {
        flags[slot] = static_cast<std::uint8_t>(random() % one_in == 0 ? random() : random() & ~mask);
        if (flags[slot] & mask) expected.push_back(slot);
      }
      ASSERT_EQ(found(mask, flags), expected) << count;
    }
}

}  // namespace
}  // namespace fathom::native::flag_scan_test
