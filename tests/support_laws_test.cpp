// What a direct solution of supports may do to a single body (dynamics/support.hpp).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "dynamics/support.hpp"
#include "random.hpp"

namespace fathom::test::support_laws_test {
namespace {

/// Twice the energy (J) of a body after `part` of a change.
double energy_after(double part, double energy, double slope, double curvature) {
  return energy + 2 * part * slope + part * part * curvature;
}

double wide(float x) { return static_cast<double>(x); }
float log_uniform(Generator& random, float lo, float hi) { return lo * std::pow(hi / lo, uniform(random, 0, 1)); }

TEST(CalmPart, LeavesWholeChangesThatKeepABodyCalm) {
  EXPECT_EQ(calm_part(0, 0, 2 * calm_body_energy, 1), 1);
  EXPECT_EQ(calm_part(8, -8, 8, 1), 1) << "a fast body comes to rest";
  EXPECT_EQ(calm_part(0, 0, 0, 1), 1);
}

TEST(CalmPart, NoBodyEndsFasterThanCalmOrThanItWas) {
  Generator random(3);
  int limited = 0;
  for (int i = 0; i < 20000; ++i) {
    const float mass = log_uniform(random, 1e-3f, 1e6f), speed = log_uniform(random, 1e-4f, 10);
    const float change = log_uniform(random, 1e-4f, 1e4f), cosine = uniform(random, -1, 1);
    const float energy = mass * speed * speed, slope = mass * speed * change * cosine,
                curvature = mass * change * change;
    const float part = calm_part(energy, slope, curvature, mass);
    ASSERT_GE(part, 0);
    ASSERT_LE(part, 1);
    const double most = wide(std::max(energy, 2 * calm_body_energy * mass));
    const auto energy_at = [&](double of) { return energy_after(of, wide(energy), wide(slope), wide(curvature)); };
    ASSERT_LE(energy_at(wide(part)), most * (1 + 1e-3)) << speed << ' ' << change << ' ' << cosine;
    if (part == 1) continue;
    ++limited;
    EXPECT_GT(energy_at(1.01 * wide(part) + 1e-6), most * (1 - 1e-3)) << "as far as it may";
  }
  EXPECT_GT(limited, 5000);
}

TEST(CalmPart, IgnoresWhatIsNotFinite) { EXPECT_EQ(calm_part(0, std::nanf(""), 1, 1), 1); }

TEST(WorthMaking, IsWhatTakesOffATenthOfTheEnergy) {
  EXPECT_TRUE(is_worth_making(1, -1, 1, 1)) << "nothing is left";
  EXPECT_FALSE(is_worth_making(0, -1, 1, 1)) << "nothing is changed";
  EXPECT_TRUE(is_worth_making(0.2f, -0.4f, 1, 1)) << "0.12 is taken off";
  EXPECT_FALSE(is_worth_making(0.2f, -0.3f, 1, 1)) << "0.08";
  EXPECT_FALSE(is_worth_making(1, std::nanf(""), 1, 1));
}

SupportRows level_support(float most) {
  SupportRows rows{};
  rows.n = {0, 0, 1}, rows.t1 = {1, 0, 0}, rows.up = 1;
  rows.friction = 0.5f, rows.max_load = most;
  std::fill(rows.weight, rows.weight + 4, 1.0f);
  return rows;
}

TEST(MaxLoad, OfABodyThatMovesIsAShareOfWhatMovesItByItsArmWithinASubstep) {
  constexpr float fall = 0.04f, h = 0.004f;
  EXPECT_FLOAT_EQ(max_load(0.125f, {0, 0, 0.1f}, 1, fall, h), moving_load * 8 * 0.1f / h);
  EXPECT_FLOAT_EQ(max_load(0.125f, {0, 0, 0.1f}, 0.1f * fall, fall, h), 10 * resting_load * 8 * 0.1f / h);
  EXPECT_GT(max_load(0.125f, {0, 0, 0.1f}, 0, fall, h), 1e8f) << "at rest";
  EXPECT_GT(max_load(0, {1, 0, 0}, 1, fall, h), 1e29f) << "what cannot be pushed bears anything";
}

TEST(MaxLoad, CountsTurningAtTheEndOfTheArm) {
  EXPECT_FLOAT_EQ(support_speed({3, 4, 0}, {0, 0, 1}, {2, 0, 0}), 5);
  EXPECT_FLOAT_EQ(support_speed({1, 0, 0}, {0, 0, 3}, {0, 2, 0}), 6);
}

TEST(MaxLoad, ASolutionRaisesALoadNoFurther) {
  const ContactImpulses before{{1, 2, 3, 4}, 0, 0, 0, 0};
  SupportChange change{{10, 10, 10, 10}, 0, 0, 0, 0};
  limit_change(level_support(30), before, change);
  for (const float normal : change.normal) EXPECT_FLOAT_EQ(normal, 5);
}

TEST(MaxLoad, ASolutionMayStillRelieveALoadBeyondIt) {
  const ContactImpulses before{{10, 20, 30, 40}, 0, 0, 0, 0};
  SupportChange lower{{-1, -1, -1, -1}, 0, 0, 0, 0}, higher{{1, 1, 1, 1}, 0, 0, 0, 0};
  limit_change(level_support(30), before, lower);
  limit_change(level_support(30), before, higher);
  for (const float normal : lower.normal) EXPECT_FLOAT_EQ(normal, -1);
  for (const float normal : higher.normal) EXPECT_FLOAT_EQ(normal, 0);
}

}  // namespace
}  // namespace fathom::test::support_laws_test
