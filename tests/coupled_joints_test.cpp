// Joints between bodies in water, whose mass differs along each axis (dynamics/inverse_inertia-inl.hpp): one sweep
// changes the bodies as their 6×6 masses, in double precision, respond to its impulse, and what the joint locks does
// not move afterwards.
#include <gtest/gtest.h>

#include "coupled_mass.hpp"
#include "dynamics/generic_joint.hpp"

namespace fathom::test::coupled_joints_test {
namespace {

constexpr float h = 1 / 240.0f;

using CoupledBodies = JointBodies<CoupledInertia<float>>;

/// A body's momentum and moment of momentum (N·s, N·m·s), laid out like its spin.
Vec6 momentum_of(const CoupledMass& mass, Quat frame, Vec3 linear, Vec3 spin) {
  return product(matrix(mass), joined(inverse_rotate(frame, linear), spin));
}

class CoupledJointsTest : public CoupledMassTest {
 protected:
  float size_ = 1;
  CoupledMass mass_a_, mass_b_;
  CoupledBodies bodies_, begin_;
  UnitQuat<float> on_a_{1, {}}, on_b_{1, {}};
  Vec3 anchor_a_, anchor_b_;
  double scale_ = 0;  ///< kg·m/s, the scale of the momenta

  /// Two bodies in motion within a step.
  void make_bodies() {
    size_ = magnitude(-1, 1);
    mass_a_ = any_mass(size_), mass_b_ = any_mass(size_ * magnitude(-0.5f, 0.5f));
    bodies_ = {side(mass_a_), side(mass_b_)};
    begin_ = bodies_;
    const auto frame = [&] {
      const Quat q = any_rotation(random_);
      return UnitQuat<float>{q.w, q.vector()};
    };
    on_a_ = frame(), on_b_ = frame();
    anchor_a_ = size_ * in_cube(random_), anchor_b_ = size_ * in_cube(random_);
    const Vec6 a = momentum_of(mass_a_, frame_a(), bodies_.a.linear, {});
    const Vec6 b = momentum_of(mass_b_, frame_b(), bodies_.b.linear, {});
    scale_ = std::sqrt(dot(a, a) + dot(b, b));
  }
  CoupledBodies::Side side(const CoupledMass& mass) {
    CoupledBodies::Side s;
    s.linear = in_cube(random_), s.angular = (1 / size_) * in_cube(random_);
    s.moved = 0.02f * size_ * in_cube(random_), s.turned = 0.5f * in_cube(random_);
    s.inverse_mass = 3 / (mass.linear.xx + mass.linear.yy + mass.linear.zz);
    s.response = inverse(mass);
    return s;
  }
  Quat frame_a() const { return turned({1, 0, 0, 0}, bodies_.a.turned); }
  Quat frame_b() const { return turned({1, 0, 0, 0}, bodies_.b.turned); }

  /// B has received this impulse in the world with this moment about its centre, and A the one given for it.
  void expect_given(Vec3 on_a, Vec3 moment_a, Vec3 on_b, Vec3 moment_b, const char* of) const {
    expect_given(mass_a_, frame_a(), begin_.a, bodies_.a, on_a, moment_a, of);
    expect_given(mass_b_, frame_b(), begin_.b, bodies_.b, on_b, moment_b, of);
  }
  void expect_given(const CoupledMass& mass, Quat frame, const CoupledBodies::Side& before,
                    const CoupledBodies::Side& after, Vec3 impulse, Vec3 moment, const char* of) const {
    const Vec6 given = momentum_of(mass, frame, after.linear - before.linear, after.angular - before.angular);
    const Vec6 expected = joined(inverse_rotate(frame, impulse), inverse_rotate(frame, moment));
    // Velocities are rounded, and the heaviest axis amplifies that error.
    const double most = 1e-5 * (scale_ + std::sqrt(dot(expected, expected))) *
                        std::sqrt(1 + wide(largest(mass)) * wide(after.inverse_mass));
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(given[i], expected[i], most) << of << ", " << i;
    for (int i = 3; i < 6; ++i) EXPECT_NEAR(given[i], expected[i], most * wide(size_)) << of << ", " << i;
  }
  static float largest(const CoupledMass& mass) { return max(max(mass.linear.xx, mass.linear.yy), mass.linear.zz); }
};

TEST_F(CoupledJointsTest, BallJoint) {
  for (int trial = 0; trial < 2000; ++trial) {
    make_bodies();
    BallJointRow<float> row{};
    prepare_ball_joint<float>({1, {}}, {1, {}}, size_ * in_cube(random_), anchor_a_, anchor_b_, {}, row);
    row.rigid = 1, row.mass_scale = 1;
    solve_ball_joint<JointPass::relax>(row, bodies_, h, true);
    const BallJointSweep<float, CoupledBodies> sweep(row, bodies_);
    const Vec3 arm_a = sweep.at_a.arm, arm_b = sweep.at_b.arm, p = row.impulse;
    const float speed = length(begin_.a.linear) + length(begin_.b.linear) + 4;
    EXPECT_LE(length(sweep.velocity()), 1e-3f * speed) << trial;
    expect_given(-p, cross(arm_a, -p), p, cross(arm_b, p), "ball joint");
    if (HasFailure()) FAIL() << trial;
  }
}

// Impulses of a substep act along the arms as they are in the next one.
TEST_F(CoupledJointsTest, ABallJointsImpulseIsCarriedAlong) {
  for (int trial = 0; trial < 2000; ++trial) {
    make_bodies();
    BallJointRow<float> row{};
    prepare_ball_joint<float>({1, {}}, {1, {}}, size_ * in_cube(random_), anchor_a_, anchor_b_, {}, row);
    const Vec3 p = static_cast<float>(scale_) * 0.01f * in_cube(random_);
    BallJointSweep<float, CoupledBodies>(row, bodies_).push(row, row.impulse = p);
    const Vec3 moment_a = row.moment_a, moment_b = row.moment_b;
    bodies_.a.turned += 0.05f * in_cube(random_), bodies_.b.turned += 0.05f * in_cube(random_);
    begin_ = bodies_;
    BallJointSweep<float, CoupledBodies> sweep(row, bodies_);
    sweep.carry_along(row, 0);
    EXPECT_EQ(row.impulse, p);
    const Vec3 now_a = rotate(frame_a(), moment_a), now_b = rotate(frame_b(), moment_b);
    expect_given({}, cross(sweep.at_a.arm, -p) - now_a, {}, cross(sweep.at_b.arm, p) - now_b, "carried");
    if (HasFailure()) FAIL() << trial;
  }
}

TEST_F(CoupledJointsTest, GenericJoint) {
  for (int trial = 0; trial < 2000; ++trial) {
    make_bodies();
    GenericJointRow<float> row{};
    prepare_generic_joint<float>({1, {}}, {1, {}}, anchor_a_ - anchor_b_ + 0.02f * size_ * in_cube(random_), on_a_,
                                 on_a_, anchor_a_, anchor_b_, row);
    row.mass_scale = 1;
    bool held[axis_count];
    for (int i = 0; i < axis_count; ++i) {
      held[i] = trial % 4 == 0 || uniform(random_, 0, 1) < 0.6f;
      row.axes[i].locked = held[i] ? 1 : 0;
    }
    solve_generic_joint<JointPass::relax>(row, bodies_, h, {}, true);
    const GenericJointRows<float, CoupledBodies> rows(row, bodies_, h);
    Vec3 impulse, torque;
    for (int i = 0; i < axis_count; ++i) {
      const float unit = i < translations ? 1 : 1 / size_;
      if (held[i]) {
        EXPECT_LE(abs(rows.velocity(i)), 8e-3f * unit) << trial << ", axis " << i;
      } else {
        EXPECT_EQ(row.hold[i], 0) << trial << ", axis " << i;
      }
      if (i < translations)
        impulse += row.hold[i] * rows.along[i];
      else
        torque += row.hold[i] * rows.torque_axis(i - translations);
    }
    expect_given(-impulse, -(cross(rows.reach(), impulse) + torque), impulse, cross(rows.arm(), impulse) + torque,
                 "generic joint");
    if (HasFailure()) FAIL() << trial;
  }
}

TEST_F(CoupledJointsTest, Coupling) {
  for (int trial = 0; trial < 2000; ++trial) {
    make_bodies();
    CouplingRow<float> row{};
    const auto end = [&](CoupledEnd<float>& e) {
      const Quat q = any_rotation(random_);
      const int kind = static_cast<int>(uniform(random_, 0, 3));
      e = {{q.w, q.vector()}, kind == 0 ? 1.0f : 0.0f, kind == 1 ? 1.0f : 0.0f, uniform(random_, 0.5f, 2)};
    };
    end(row.coupling.a), end(row.coupling.b);
    prepare_coupling<float>({1, {}}, {1, {}}, 3 * size_ * in_cube(random_), 3 * size_ * in_cube(random_), on_a_, on_b_,
                            anchor_a_, anchor_b_, {}, {}, row);
    row.rigid = 1, row.mass_scale = 1;
    solve_coupling<JointPass::relax>(row, bodies_, h, true);
    const CouplingSweep<float, CoupledBodies> sweep(row, bodies_, h);
    const float of_a = row.coupling.a.share * row.impulse, of_b = row.coupling.b.share * row.impulse;
    EXPECT_LE(abs(sweep.velocity()), 5e-3f * (1 + 1 / size_)) << trial;
    expect_given(of_a * sweep.a.at.push, of_a * sweep.a.at.moment, of_b * sweep.b.at.push, of_b * sweep.b.at.moment,
                 "coupling");
    if (HasFailure()) FAIL() << trial;
  }
}

}  // namespace
}  // namespace fathom::test::coupled_joints_test
