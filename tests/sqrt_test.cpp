// The square root for back ends whose own is approximate, against the processor's.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "fathom/math.hpp"

namespace fathom::sqrt_test {
namespace {

/// An estimate that is `ulps` units in the last place off the correct one.
struct Off {
  int ulps;
  float operator()(float x) const { return std::bit_cast<float>(std::bit_cast<std::uint32_t>(std::sqrt(x)) + ulps); }
};

float root(std::uint32_t bits, int ulps) { return correctly_rounded_sqrt(std::bit_cast<float>(bits), Off{ulps}); }

/// How many of the numbers with the bits `first`, `first` + `step`, … below `end` have a wrong root.
int wrong_roots(std::uint32_t first, std::uint32_t end, std::uint32_t step, int ulps) {
  int wrong = 0;
  for (std::uint64_t bits = first; bits < end; bits += step) {
    const auto b = static_cast<std::uint32_t>(bits);
    wrong +=
        std::bit_cast<std::uint32_t>(root(b, ulps)) != std::bit_cast<std::uint32_t>(std::sqrt(std::bit_cast<float>(b)));
  }
  return wrong;
}

constexpr std::uint32_t one = 0x3f800000, four = 0x40800000, infinity_bits = 0x7f800000;

// A root's last bits depend on the mantissa and on whether the exponent is even, so [1, 4) covers everything.
TEST(CorrectlyRoundedSqrt, OfEveryMantissaFromEveryEstimate) {
  for (int ulps = -4; ulps <= 4; ++ulps) EXPECT_EQ(wrong_roots(one, four, 1, ulps), 0) << ulps << " ulp off";
}

TEST(CorrectlyRoundedSqrt, OfEveryExponentAndDenormals) {
  for (int ulps = -3; ulps <= 3; ++ulps) {
    EXPECT_EQ(wrong_roots(1, infinity_bits, 4099, ulps), 0) << ulps << " ulp off";
    EXPECT_EQ(wrong_roots(1, 1 << 16, 1, ulps), 0) << "denormals, " << ulps << " ulp off";
    EXPECT_EQ(wrong_roots(infinity_bits - (1 << 16), infinity_bits, 1, ulps), 0) << "largest, " << ulps << " ulp off";
    for (std::uint32_t power = 1 << 23; power < infinity_bits; power += 1 << 23) {
      EXPECT_EQ(wrong_roots(power - 100, power + 100, 1, ulps), 0) << "around a power of two, " << ulps << " ulp off";
    }
  }
}

TEST(CorrectlyRoundedSqrt, OfWhatHasNone) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(root(infinity_bits, 0), infinity);
  EXPECT_EQ(root(0, 0), 0.0f);
  EXPECT_FALSE(std::signbit(root(0, 0)));
  EXPECT_TRUE(std::signbit(root(0x80000000, 0)));
  for (const float a : {-1.0f, -infinity, -0x1p-149f, std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(root(std::bit_cast<std::uint32_t>(a), 0))) << a;
  }
}

}  // namespace
}  // namespace fathom::sqrt_test
