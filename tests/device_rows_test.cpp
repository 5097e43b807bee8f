// A device's rows are those of the laws, laid out in quads (device/constraint_rows.hpp, joint_sweeps.hpp): each kind of
// constraint, stored and loaded between sweeps, equals bit for bit the row that never left its registers.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "device/joint_sweeps.hpp"
#include "dynamics/contact_rows.hpp"
#include "random.hpp"

namespace fathom::device::device_rows_test {
namespace {

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

class DeviceRows : public testing::Test {
 protected:
  using Bodies = JointBodies<SymMat3>;
  static constexpr float h = 1.0f / 240;

  test::Generator random_{23};
  Quad rows_[row_count * tile_width]{};

  float uniform(float lo, float hi) { return test::uniform(random_, lo, hi); }
  float flag() { return random_() % 2 ? 1.0f : 0.0f; }
  Vec3 vector(float size) { return uniform(0, size) * test::on_sphere(random_); }
  UnitQuat<float> orientation() {
    const Quat q = normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
    return {q.w, q.vector()};
  }
  Bodies bodies() {
    const auto side = [&] {
      const float inverse_mass = flag() * std::pow(10.0f, uniform(-2, 2)), spin = inverse_mass * uniform(0.5f, 5);
      return Bodies::Side{vector(5), vector(5), vector(0.1f), vector(0.1f), inverse_mass, spin, tensor(spin)};
    };
    return {side(), side()};
  }
  /// One constraint's quads, as sweeps fetch them.
  void fetch(Quad (&q)[row_count]) const {
    for (std::uint32_t r = 0; r < row_count; ++r) q[r] = rows_[r * tile_width];
  }
  template <class Row>
  static void soften(Row& row) {
    row.bias_rate = 60, row.mass_scale = 0.7f, row.impulse_scale = 0.3f;
  }

  /// Every sweep over a row that stays in place, `law`, and over one that `load` makes from the quads each time.
  template <class Law, class Load>
  void compare(Law law, const Load& load) {
    Bodies kept = bodies(), stored = kept;
    const auto once = [&](const auto& act) {
      act(law, kept);
      Quad q[row_count];
      fetch(q);
      auto loaded = load(q);
      act(loaded, stored);
      loaded.store(rows_, true);
      EXPECT_TRUE(same_bits(kept, stored));
    };
    once([](auto& l, Bodies& b) { l.warm_start(b); });
    for (int substep = 0; substep < 3; ++substep) {
      once([](auto& l, Bodies& b) { l.template solve<JointPass::soft>(b, h, false); });
      once([](auto& l, Bodies& b) { l.template solve<JointPass::relax>(b, h, true); });
      once([](auto& l, Bodies& b) { l.template solve<JointPass::iterate>(b, h, true); });
    }
  }
};

TEST_F(DeviceRows, OfBallJoints) {
  for (int trial = 0; trial < 500; ++trial) {
    BallJointRow<float> row{};
    row.arm_a = vector(2), row.arm_b = vector(2), row.gap = vector(0.1f), row.impulse = vector(3);
    soften(row);
    row.rigid = flag(), row.most = (1 - row.rigid) * uniform(0, 5);
    row.compliance = (1 - row.rigid) * uniform(0, 1);
    store_joint(rows_, row), store_joint_impulse(rows_, row), store_joint_total(rows_, row);
    Quad q[row_count];
    fetch(q);
    BallJointSweep law(q);
    law.row = row;
    compare(law, [](const Quad* quads) { return BallJointSweep(quads); });
  }
}

TEST_F(DeviceRows, OfGenericJoints) {
  for (int trial = 0; trial < 500; ++trial) {
    GenericJoint joint;
    joint.moves = joint.reacts = 1, joint.min_hit = 1;
    joint.distance = random_() % 4 == 0 ? 1.0f : 0.0f, joint.cone = random_() % 4 == 0 ? 1.0f : 0.0f;
    for (auto& axis : joint.axes) {
      axis.locked = flag(), axis.limited = (1 - axis.locked) * flag();
      axis.lower = -uniform(0, 1), axis.upper = axis.locked > 0 ? axis.lower : uniform(0, 1);
      axis.velocity = uniform(-5, 5), axis.compliance = flag(), axis.most = flag() * uniform(0, 10);
      axis.restitution = flag() * uniform(0, 1), axis.armature = flag() * uniform(0, 1);
    }
    GenericJointRow<float> row{};
    row.frame_a = orientation(), row.frame_b = orientation();
    row.arm_a = vector(2), row.arm_b = vector(2), row.gap = vector(0.1f);
    soften(row);
    row.distance = joint.distance, row.cone = joint.cone, row.min_hit = joint.min_hit;
    for (int i = 0; i < axis_count; ++i)
      row.axes[i] = joint.axes[i], row.hold[i] = uniform(-1, 1), row.drive[i] = uniform(-1, 1);
    JointReactions kept{}, stored{};
    store_generic_start(rows_, row), store_generic_impulses(rows_, row);
    store_reactions(stored, row, joint.use());
    Quad q[row_count];
    fetch(q);
    GenericJointSweep law(q, joint, kept);
    law.row = row;
    compare(law, [&](const Quad* quads) { return GenericJointSweep(quads, joint, stored); });
  }
}

TEST_F(DeviceRows, OfCouplings) {
  for (int trial = 0; trial < 500; ++trial) {
    GenericJoint joint;
    joint.couples = 1, joint.rigid = flag(), joint.axes[0].limited = flag();
    joint.softness = {60, 0.7f, 0.3f};
    joint.axes[0].lower = uniform(-5, 0), joint.axes[0].upper = uniform(0, 5);
    const auto end = [&] {
      const bool turns = random_() % 3 == 0;
      return CoupledEnd<float>{orientation(), turns ? 1.0f : 0.0f, turns ? 0.0f : flag(), uniform(-3, 3)};
    };
    joint.coupling.ends = {end(), end(), flag()};
    joint.coupling.from_a = vector(2), joint.coupling.from_b = vector(2);
    const auto pose = [&] {
      const UnitQuat<float> q = orientation();
      return Pose{vector(3), 0, {q.w, q.v.x, q.v.y, q.v.z}};
    };
    GenericImpulse last;
    last.hold[0] = uniform(-5, 5), last.drive[0] = std::round(uniform(-9, 9)), last.drive[1] = uniform(-3, 3);
    const CouplingRow<float> row = prepared_coupling(joint, vector(1), vector(1), pose(), pose(), last);
    JointReactions reactions{};
    store_coupling(rows_, reactions, row);
    Quad q[row_count];
    fetch(q);
    CouplingSweep law(q, joint, reactions);
    law.row = row;
    compare(law, [&](const Quad* quads) { return CouplingSweep(quads, joint, reactions); });
  }
}

/// A contact's rows as a sweep needs them; `store` keeps what sweeps write.
struct ContactSweep {
  ContactRows rows;

  template <class Bodies>
  void warm_start(Bodies& bodies) {
    warm_start_contact<float>(rows, bodies);
  }
  template <JointPass pass, class Bodies>
  void solve(Bodies& bodies, float h, bool) {
    constexpr auto as = static_cast<ContactPass>(pass);
    const ContactAxes axes = rows.axes();
    solve_points<as, true>(rows, axes, bodies, contact_step(1 / h, {60, 0.7f, 0.3f}, 4));
    sweep_friction(rows, axes, bodies, [](Vec3 slide) { return slide; });
  }
  void store(Quad* to, bool) const {
    store_normal_impulses(to, rows.impulses);
    store_friction_impulses(to, rows.impulses);
  }
};

TEST_F(DeviceRows, OfContacts) {
  for (int trial = 0; trial < 500; ++trial) {
    const UnitQuat<float> turned = orientation();
    const Quat q_frame{turned.w, turned.v.x, turned.v.y, turned.v.z};
    ContactSweep law{};
    ContactRows& rows = law.rows;
    rows.set_frame(ContactAxes(rotate(q_frame, {1, 0, 0}), rotate(q_frame, {0, 1, 0}), vector(2), vector(2)));
    rows.set_response({uniform(1, 2), uniform(0, 1), uniform(0, 1), uniform(1, 2), uniform(0, 1), uniform(1, 2)});
    rows.set_friction({uniform(0, 1), uniform(0, 1), uniform(1, 2), uniform(0, 1), uniform(1, 2), uniform(0, 1)});
    rows.count = 1 + static_cast<int>(random_() % max_manifold_points);
    for (int i = 0; i < rows.count; ++i)
      rows.set_point(i, {uniform(-1, 1), uniform(-1, 1), uniform(-0.01f, 0.01f), uniform(0, 2)}),
          rows.set_impulse(i, flag() * uniform(0, 2));
    rows.set_friction_impulse({uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
    store_frame(rows_, rows.frame);
    for (int i = 0; i < rows.count; ++i) store_point(rows_, i, rows.points[i]);
    law.store(rows_, true);
    compare(law, [&](const Quad* quads) {
      ContactSweep loaded{};
      load_contact(quads, rows.count, loaded.rows);
      return loaded;
    });
  }
}

}  // namespace
}  // namespace fathom::device::device_rows_test
