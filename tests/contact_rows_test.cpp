// The rows of a contact and the sweeps over them, over the whole range of floats that a world accepts: sizes from 1 mm
// to 1 km, slenderness to 1000:1, spins to 1000 rad/s.
#include "dynamics/contact_rows.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "collision/collide.hpp"
#include "dynamics/manifold_update.hpp"
#include "random.hpp"

namespace fathom::test::contact_rows_test {
namespace {

class RowsOfContacts : public testing::Test {
 protected:
  Generator random_{11};

  float uniform(float lo, float hi) { return test::uniform(random_, lo, hi); }
  float magnitude(float from, float to) { return std::pow(10.0f, uniform(from, to)); }
  Vec3 direction() { return on_sphere(random_); }
  Quat orientation() { return normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}); }

  struct Solid {
    Vec3 half;
    Pose pose;
    ContactBody<SymMat3> body{};
    SymMat3 inertia;
  };

  Solid solid(float size, Vec3 position) {
    Solid s;
    s.half = size * Vec3{1, magnitude(-3, 0), magnitude(-3, 0)};
    s.pose = {position, 0, orientation()};
    const float mass = 8 * magnitude(1, 4) * s.half.x * s.half.y * s.half.z, third = mass / 3;
    const SymMat3 principal{third * (s.half.y * s.half.y + s.half.z * s.half.z),
                            third * (s.half.x * s.half.x + s.half.z * s.half.z),
                            third * (s.half.x * s.half.x + s.half.y * s.half.y),
                            0,
                            0,
                            0};
    const SymMat3 inverse{1 / principal.xx, 1 / principal.yy, 1 / principal.zz, 0, 0, 0};
    s.inertia = rotated(to_matrix(s.pose.rotation), principal);
    s.body = {magnitude(-3, 3) * direction(), magnitude(-3, 3) * direction(), 1 / mass,
              rotated(to_matrix(s.pose.rotation), inverse)};
    return s;
  }

  static double energy(const Solid& s) {
    const auto product = [](Vec3 a, Vec3 b) {
      return static_cast<double>(a.x) * static_cast<double>(b.x) + static_cast<double>(a.y) * static_cast<double>(b.y) +
             static_cast<double>(a.z) * static_cast<double>(b.z);
    };
    return 0.5 * (product(s.body.linear, s.body.linear) / static_cast<double>(s.body.inverse_mass) +
                  product(s.body.angular, s.inertia * s.body.angular));
  }
};

// Random touching boxes: their manifolds are finite, and a relax sweep over their rows leaves everything finite,
// impulses that push and stay in their cones, and no more energy than before.
TEST_F(RowsOfContacts, SweepsStayFiniteInTheirConesAndPassive) {
  int touching = 0;
  for (int i = 0; i < 40000; ++i) {
    const float size = magnitude(-3, 3);
    Solid a = solid(size, {}), b = solid(size * magnitude(-1, 1), {});
    // B with one of its corners close to a point of A.
    const auto on = [&](const Solid& s) {
      return rotate(s.pose.rotation,
                    Vec3{uniform(-1, 1) * s.half.x, uniform(-1, 1) * s.half.y, uniform(-1, 1) * s.half.z});
    };
    b.pose.position = on(a) - on(b);
    const Pose b_in_a = relative(a.pose, b.pose);
    AxisCache cache;
    const Manifold fresh = collide_boxes(a.half, b.half, b_in_a, 0.02f, cache);
    ASSERT_GE(fresh.count, 0);
    ASSERT_LE(fresh.count, max_manifold_points);
    if (fresh.count == 0) continue;
    ++touching;
    ContactManifold m;
    set_manifold(m, fresh, b_in_a);
    m.friction = uniform(0, 1);
    ASSERT_NEAR(length(m.normal), 1, 1e-4);
    ASSERT_NEAR(length(m.tangent), 1, 1e-4);
    ContactBodies<SymMat3> bodies{a.body, b.body};
    ContactRows rows;
    const float nearest = prepare_contact(m, a.pose, b.pose, {}, bodies, rows);
    ASSERT_TRUE(is_finite(nearest));
    const ContactAxes axes = rows.axes();
    const ContactStep step = contact_step(240, {}, 0);
    const auto all_energy = [&] {
      a.body = bodies.a, b.body = bodies.b;
      return energy(a) + energy(b);
    };
    const double before = all_energy();
    // Without bias, and starting from zero, each sweep removes energy at approaching points.
    for (int p = 0; p < rows.count; ++p) rows.points[p].separation = 0;
    const auto still = [](Vec3 slide) { return slide; };
    const ContactImpulses& impulses = rows.impulses;
    for (int sweep = 0; sweep < 4; ++sweep) {
      solve_points<ContactPass::relax, false>(rows, axes, bodies, step);
      sweep_friction(rows, axes, bodies, still);
      ASSERT_TRUE(is_sound(bodies, impulses)) << "trial " << i;
      for (const float impulse : impulses.normal) ASSERT_GE(impulse, 0);
      const float limit = rows.frame.friction.coefficient * impulses.sum();
      ASSERT_LE(std::hypot(impulses.slide_1, impulses.slide_2), 1.0001f * limit);
      ASSERT_LE(std::abs(impulses.twist), 1.0001f * limit * rows.frame.friction.patch_radius);
      ASSERT_LE(all_energy(), 1.01 * before) << "trial " << i << ", sweep " << sweep << ", size " << size;
    }
  }
  EXPECT_GT(touching, 10000);
}

// A body or an impulse that is not finite is detected.
TEST_F(RowsOfContacts, WhatIsNotFiniteIsNotSound) {
  const float bad[] = {__builtin_nanf(""), __builtin_inff(), -__builtin_inff()};
  for (const float value : bad)
    for (int i = 0; i < 12 + 7; ++i) {
      ContactBodies<float> bodies{{{1, 2, 3}, {4, 5, 6}, 1, 1}, {{1, 2, 3}, {4, 5, 6}, 1, 1}};
      auto &a = bodies.a, &b = bodies.b;
      ContactImpulses impulses;
      ASSERT_TRUE(is_sound(bodies, impulses));
      float* const places[] = {&a.linear.x,       &a.linear.y,         &a.linear.z,         &a.angular.x,
                               &a.angular.y,      &a.angular.z,        &b.linear.x,         &b.linear.y,
                               &b.linear.z,       &b.angular.x,        &b.angular.y,        &b.angular.z,
                               impulses.normal,   impulses.normal + 1, impulses.normal + 2, impulses.normal + 3,
                               &impulses.slide_1, &impulses.slide_2,   &impulses.twist};
      *places[i] = value;
      EXPECT_FALSE(is_sound(bodies, impulses)) << i;
    }
}

}  // namespace
}  // namespace fathom::test::contact_rows_test
