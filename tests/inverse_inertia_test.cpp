// The response of bodies with each kind of inertia to an impulse; the coupled kind of a body in water against direct
// solutions in double precision: masses from a gram to a million tonnes, sizes from a centimetre to a kilometre.
#include "dynamics/inverse_inertia.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "coupled_mass.hpp"
#include "dynamics/contact_rows.hpp"

namespace fathom::test::inverse_inertia_test {
namespace {

/// By Gauss–Jordan elimination, with the largest pivot relative to each row's scale.
Mat6 direct_inverse(Mat6 m) {
  Mat6 inverse{};
  Vec6 unit;
  for (int i = 0; i < 6; ++i) unit[i] = 1 / std::sqrt(m[i][i]);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) m[i][j] *= unit[i] * unit[j];
  for (int i = 0; i < 6; ++i) inverse[i][i] = 1;
  for (int c = 0; c < 6; ++c) {
    int pivot = c;
    for (int i = c; i < 6; ++i)
      if (std::abs(m[i][c]) > std::abs(m[pivot][c])) pivot = i;
    std::swap(m[c], m[pivot]), std::swap(inverse[c], inverse[pivot]);
    const double scale = 1 / m[c][c];
    for (int j = 0; j < 6; ++j) m[c][j] *= scale, inverse[c][j] *= scale;
    for (int i = 0; i < 6; ++i) {
      if (i == c) continue;
      const double factor = m[i][c];
      for (int j = 0; j < 6; ++j) m[i][j] -= factor * m[c][j], inverse[i][j] -= factor * inverse[c][j];
    }
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) inverse[i][j] *= unit[i] * unit[j];
  return inverse;
}

class InverseInertiaTest : public CoupledMassTest {};

TEST_F(InverseInertiaTest, CoupledInverseIsTheDirectOne) {
  for (int trial = 0; trial < 20000; ++trial) {
    const CoupledMass mass = any_mass(magnitude(-2, 3));
    const Mat6 expected = direct_inverse(matrix(mass)), made = matrix(inverse(mass));
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        ASSERT_NEAR(made[i][j], expected[i][j], 1e-7 * std::sqrt(expected[i][i] * expected[j][j]) + 1e-38)
            << trial << ": " << i << ", " << j;
  }
}

TEST_F(InverseInertiaTest, CoupledAnswersAreThoseOfTheMatrix) {
  for (int trial = 0; trial < 20000; ++trial) {
    const float size = magnitude(-2, 3);
    const CoupledInertia<float> w = inverse(any_mass(size));
    const Mat6 m = matrix(w);
    const Vec3 direction = on_sphere(random_), arm = size * in_cube(random_), moment = cross(arm, direction);
    const Vec6 wrench = joined(direction, moment), expected = product(m, wrench);
    const Vec6 made = joined(w.moved_by(direction, moment), w.spun_by(direction, moment));
    double size_of[6] = {};
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) size_of[i] += std::abs(m[i][j] * wrench[j]);
    for (int i = 0; i < 6; ++i) ASSERT_NEAR(made[i], expected[i], 1e-6 * size_of[i]) << trial << ": " << i;
    double terms = 0;
    for (int i = 0; i < 6; ++i) terms += size_of[i] * std::abs(wrench[i]);
    const double response = wide(w.response(direction, moment));
    ASSERT_NEAR(response, dot(wrench, expected), 1e-6 * terms) << trial;
    ASSERT_GT(response, 0);

    Vec3 linear, angular;
    w.push(linear, angular, direction, moment);
    EXPECT_EQ(linear, w.moved_by(direction, moment));
    w.twist(linear, angular, moment);
    w.twist_back(linear, angular, moment);
    w.pull(linear, angular, direction, moment);
    ASSERT_LE(length(linear), 1e-5f * length(w.moved_by(direction, moment)) + 1e-5f * length(w.moved_by({}, moment)));
  }
}

TEST_F(InverseInertiaTest, TurnedWithTheBody) {
  for (int trial = 0; trial < 2000; ++trial) {
    const float size = magnitude(-1, 2);
    const CoupledInertia<float> w = inverse(any_mass(size));
    const Quat q = any_rotation(random_);
    const CoupledInertia<float> turned = rotated(to_matrix(q), w);
    const Vec3 impulse = on_sphere(random_), moment = size * in_cube(random_);
    const Vec3 moved = rotate(q, w.moved_by(inverse_rotate(q, impulse), inverse_rotate(q, moment)));
    const Vec3 spun = rotate(q, w.spun_by(inverse_rotate(q, impulse), inverse_rotate(q, moment)));
    const float fastest = w.linear.xx + w.linear.yy + w.linear.zz,
                quickest = w.angular.xx + w.angular.yy + w.angular.zz;
    ASSERT_LE(length(turned.moved_by(impulse, moment) - moved),
              4e-6f * (fastest + size * fathom::sqrt(fastest * quickest)));
    ASSERT_LE(length(turned.spun_by(impulse, moment) - spun),
              4e-6f * (size * quickest + fathom::sqrt(fastest * quickest)));
  }
}

// Without coupling, every kind agrees with the others.
TEST_F(InverseInertiaTest, KindsAgreeWhereTheyMeet) {
  for (int trial = 0; trial < 2000; ++trial) {
    const float mass = magnitude(-6, 6), inertia = magnitude(-6, 6);
    const auto number = inverse_inertia(1 / mass, 1 / inertia);
    const auto as_tensor = inverse_inertia(1 / mass, tensor(1 / inertia));
    const CoupledMass alone{tensor(mass), {{}, {}, {}}, tensor(inertia)};
    const auto coupled = inverse_inertia(1 / mass, inverse(alone));
    const Vec3 direction = on_sphere(random_), moment = in_cube(random_);
    EXPECT_EQ(number.spun_by(direction, moment), as_tensor.spun_by(direction, moment));
    EXPECT_EQ(number.response(direction, moment), as_tensor.response(direction, moment));
    EXPECT_NEAR(number.response(direction, moment), coupled.response(direction, moment),
                1e-6f * number.response(direction, moment));
    EXPECT_LE(length(number.moved_by(direction, moment) - coupled.moved_by(direction, moment)), 1e-6f / mass);
    EXPECT_LE(length(number.spun_by(moment) - coupled.spun_by(direction, moment)), 1e-6f / inertia * length(moment));
  }
}

// A contact's rows see the response of coupled bodies, and its sweeps only remove energy.
TEST_F(InverseInertiaTest, ContactRowsOfCoupledBodies) {
  for (int trial = 0; trial < 5000; ++trial) {
    const float size = magnitude(-2, 2);
    const CoupledMass mass_a = any_mass(size), mass_b = any_mass(size * magnitude(-1, 0));
    ContactBodies<CoupledInertia<float>> bodies{
        {in_cube(random_), (1 / size) * in_cube(random_), 1 / mass_a.linear.xx, inverse(mass_a)},
        {in_cube(random_), (1 / size) * in_cube(random_), 1 / mass_b.linear.xx, inverse(mass_b)}};
    const auto energy_of = [](const CoupledMass& mass, const ContactBody<CoupledInertia<float>>& body) {
      const Vec6 v = joined(body.linear, body.angular);
      return 0.5 * dot(v, product(matrix(mass), v));
    };
    const auto energy = [&] { return energy_of(mass_a, bodies.a) + energy_of(mass_b, bodies.b); };

    const Vec3 normal = on_sphere(random_), on_a = size * in_cube(random_),
               between = on_a + 0.3f * size * in_cube(random_);
    ContactManifold m;
    m.normal = normal;
    m.tangent = any_perpendicular(normal);
    m.friction = uniform(random_, 0, 1);
    for (int i = 0; i < max_manifold_points; ++i) {
      const Vec3 across = cross(normal, m.tangent);
      const float x = i % 2 ? 0.2f : -0.2f, y = i / 2 ? 0.2f : -0.2f;
      m.points[i].anchor_a = on_a + size * (x * m.tangent + y * across);
      m.points[i].anchor_b = m.points[i].anchor_a - between;
    }
    m.set_build({between, 0, {}}, max_manifold_points);
    ContactRows rows;
    prepare_contact(m, {}, {between, 0, {}}, {}, bodies, rows);
    const ContactAxes axes = rows.axes();

    // A unit impulse at c changes the velocities by the first row of K.
    auto pushed = bodies;
    push_normal(pushed, axes, NormalMotion{1, 0, 0});
    const NormalMotion before = axes.velocity(bodies), after = axes.velocity(pushed);
    const auto& k = rows.frame.response;
    const float speed = 1 + abs(before.n) + size * (length(bodies.a.angular) + length(bodies.b.angular));
    ASSERT_NEAR(after.n - before.n, k.nn, 1e-5f * (k.nn + speed)) << trial;
    ASSERT_NEAR(after.t1 - before.t1, k.n1, 1e-5f * (k.nn + speed) / size + 1e-5f * abs(k.n1)) << trial;

    const ContactStep step = contact_step(240, {}, 0);
    const auto still = [](Vec3 slide) { return slide; };
    // Friction's limit grows with the load from sweep to sweep, so energy falls below its initial value, but not in
    // each sweep.
    const double at_start = energy();
    for (int sweep = 0; sweep < 4; ++sweep) {
      solve_points<ContactPass::relax, false>(rows, axes, bodies, step);
      sweep_friction(rows, axes, bodies, still);
      ASSERT_TRUE(is_sound(bodies, rows.impulses)) << trial;
      ASSERT_LE(energy(), 1.0001 * at_start) << trial << ", sweep " << sweep;
    }
  }
}

}  // namespace
}  // namespace fathom::test::inverse_inertia_test
