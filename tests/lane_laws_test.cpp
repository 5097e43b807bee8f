// Laws over a lane type give each lane of a vector what they give one number (dynamics/*-inl.hpp), on random rows of
// joints. Vectors fuse the products of cross(), numbers do not, so the two are equal to rounding.
#define HWY_DISABLE_PCLMUL_AES
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "dynamics/generic_joint.hpp"
#include "native/couplings-inl.hpp"
#include "random.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {
namespace {

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr std::size_t width = hn::MaxLanes(D());

/// The floats of a row or a body, which have no others and no padding: one number each, or a vector.
template <class Of>
constexpr std::size_t floats = sizeof(Of) / sizeof(float);

template <class One, class Many>
void put(const std::array<One, width>& ones, Many& many) {
  static_assert(sizeof(Many) == width * sizeof(One));
  for (std::size_t lane = 0; lane < width; ++lane)
    for (std::size_t k = 0; k < floats<One>; ++k)
      std::memcpy(reinterpret_cast<float*>(&many) + k * width + lane, reinterpret_cast<const float*>(&ones[lane]) + k,
                  sizeof(float));
}
template <class One, class Many>
One get(const Many& many, std::size_t lane) {
  One one;
  for (std::size_t k = 0; k < floats<One>; ++k)
    std::memcpy(reinterpret_cast<float*>(&one) + k, reinterpret_cast<const float*>(&many) + k * width + lane,
                sizeof(float));
  return one;
}

/// What a sweep reads of a body, by number or by lanes.
template <class Number, class Vector, class Tensor>
struct SideOf {
  Vector linear, angular, moved, turned;
  Number inverse_mass, inverse_inertia;
  Tensor response;
};
using Side = SideOf<float, Vec3, SymMat3>;
using SideV = SideOf<V, Vec3V<V>, SymMat3V<V>>;

struct BodiesV {
  static constexpr bool only_pushes_b = false, all_isotropic = false;
  SideV a, b;
  InverseInertia<V, const SymMat3V<V>&> inverse_of_a() const { return {a.inverse_mass, a.response}; }
  InverseInertia<V, const SymMat3V<V>&> inverse_of_b() const { return {b.inverse_mass, b.response}; }
};

class LaneLaws : public testing::Test {
 protected:
  test::Random random_{17};

  float uniform(float lo, float hi) { return test::uniform(random_, lo, hi); }
  float magnitude(float from, float to) { return std::pow(10.0f, uniform(from, to)); }
  float flag() { return random_() % 2 ? 1.0f : 0.0f; }
  Vec3 direction() { return test::on_sphere(random_); }
  Vec3 vector(float from, float to) { return magnitude(from, to) * direction(); }
  fathom::UnitQuat<float> orientation() {
    const Quat q = normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)});
    return {q.w, {q.x, q.y, q.z}};
  }
  /// An isotropic body, an anisotropic one up to 10:1, or one that cannot be pushed.
  Side side() {
    Side s{vector(-1, 1), vector(-1, 1), vector(-3, -1), vector(-3, -1), magnitude(-1, 1), 0, {}};
    const float size = s.inverse_mass * magnitude(-1, 1);
    switch (random_() % 4) {
      case 0:
        s.inverse_mass = 0;
        break;
      case 1:
        s.inverse_inertia = size, s.response = {size, size, size, 0, 0, 0};
        break;
      default: {
        const SymMat3 principal{size, size * magnitude(-1, 0), size * magnitude(-1, 0), 0, 0, 0};
        const auto q = orientation();
        s.response = rotated(to_matrix(Quat{q.w, q.v.x, q.v.y, q.v.z}), principal);
      }
    }
    return s;
  }
  template <class Row>
  void soften(Row& row) {
    row.bias_rate = magnitude(0, 3), row.mass_scale = uniform(0, 1), row.impulse_scale = uniform(0, 1);
    row.rigid = flag();
  }
  fathom::BallJointRow<float> ball() {
    fathom::BallJointRow<float> row{};
    row.arm_a = vector(-1, 0.5f), row.arm_b = vector(-1, 0.5f), row.gap = vector(-3, -1);
    row.impulse = flag() * vector(-1, 0.5f), row.total = row.impulse, row.pull = flag() * vector(-1, 1);
    row.spun_a = flag() * vector(-1, 0.5f), row.spun_b = flag() * vector(-1, 0.5f);
    soften(row);
    row.most = flag() * magnitude(-1, 1);
    return row;
  }
  fathom::GenericJointRow<float> generic() {
    fathom::GenericJointRow<float> row{};
    row.frame_a = orientation(), row.frame_b = random_() % 4 ? orientation() : row.frame_a;
    row.arm_a = vector(-1, 0.5f), row.arm_b = vector(-1, 0.5f), row.gap = vector(-3, -1);
    row.pull = flag() * vector(-1, 1);
    soften(row);
    row.distance = random_() % 4 == 0 ? 1.0f : 0.0f, row.cone = random_() % 4 == 0 ? 1.0f : 0.0f;
    for (auto& axis : row.axes) {
      axis.locked = flag(), axis.limited = (1 - axis.locked) * flag();
      axis.lower = -magnitude(-3, 0), axis.upper = axis.locked > 0 ? axis.lower : magnitude(-3, 0);
      axis.target = uniform(-1, 1), axis.approach = flag() * magnitude(-1, 2), axis.velocity = uniform(-5, 5);
      axis.compliance = flag() * magnitude(-6, 1), axis.response = flag(), axis.most = flag() * magnitude(-1, 2);
      axis.restitution = flag() * uniform(0, 1), axis.armature = flag() * magnitude(-3, 1);
    }
    for (int i = 0; i < axis_count; ++i) row.hold[i] = flag() * uniform(-3, 3), row.drive[i] = flag() * uniform(-1, 1);
    row.given = flag() * vector(-2, 1), row.spun_a = flag() * vector(-1, 0.5f), row.spun_b = flag() * vector(-1, 0.5f);
    row.min_hit = 1;
    return row;
  }
  fathom::CoupledEnd<float> end() {
    fathom::CoupledEnd<float> e{orientation(), 0, 0, uniform(-3, 3)};
    (random_() % 3 == 0 ? e.turns : e.rope) = flag();
    return e;
  }
  fathom::CouplingRow<float> coupling() {
    fathom::CouplingRow<float> row{};
    row.frame_a = orientation(), row.frame_b = orientation();
    row.arm_a = vector(-1, 0.5f), row.arm_b = vector(-1, 0.5f), row.way_a = vector(-1, 0.5f),
    row.way_b = vector(-1, 0.5f);
    row.start_a = {std::round(uniform(-50, 50)), uniform(-3, 3)}, row.start_b = {0, uniform(-3, 3)};
    row.angle_a = row.start_a, row.angle_b = row.start_b;
    row.coupling = {end(), end(), flag()};
    soften(row);
    row.lower = uniform(-5, 0), row.upper = uniform(0, 5), row.limited = flag();
    row.impulse = flag() * uniform(-10, 10);
    return row;
  }

  /// Compares `solve(row, bodies)` on rows side by side with each of them alone.
  template <class Row, class RowV, class Make, class Solve>
  void compare(const Make& make, const Solve& solve) {
    for (int trial = 0; trial < 2000; ++trial) {
      std::array<Row, width> rows;
      std::array<Side, width> as, bs;
      for (std::size_t lane = 0; lane < width; ++lane) rows[lane] = make(), as[lane] = side(), bs[lane] = side();
      RowV row_v;
      BodiesV bodies_v;
      put(rows, row_v), put(as, bodies_v.a), put(bs, bodies_v.b);
      solve(row_v, bodies_v, hn::Set(D(), h));
      for (std::size_t lane = 0; lane < width; ++lane) {
        JointBodies<SymMat3> bodies{alone(as[lane]), alone(bs[lane])};
        solve(rows[lane], bodies, h);
        const Side a_v = get<Side>(bodies_v.a, lane), b_v = get<Side>(bodies_v.b, lane);
        for (const auto& [many, one] : {std::pair{a_v.linear, bodies.a.linear},
                                        {a_v.angular, bodies.a.angular},
                                        {b_v.linear, bodies.b.linear},
                                        {b_v.angular, bodies.b.angular}})
          look(many.x, one.x), look(many.y, one.y), look(many.z, one.z);
        const Row row = get<Row>(row_v, lane);
        for (std::size_t k = 0; k < floats<Row>; ++k) look(field(row, k), field(rows[lane], k));
      }
    }
    // A bound that is met to rounding may hold in one and not in the other.
    EXPECT_LE(differ_, looked_ / 1000) << "of " << looked_;
  }
  static JointBodies<SymMat3>::Side alone(const Side& s) {
    return {s.linear, s.angular, s.moved, s.turned, s.inverse_mass, s.inverse_inertia, s.response};
  }
  void look(float of_many, float alone) {
    ++looked_;
    differ_ += !(std::abs(of_many - alone) <= 1e-3f * std::max(1.0f, std::abs(alone)));
  }
  template <class Row>
  static float field(const Row& row, std::size_t k) {
    float value;
    std::memcpy(&value, reinterpret_cast<const float*>(&row) + k, sizeof value);
    return value;
  }
  std::size_t looked_ = 0, differ_ = 0;
  static constexpr float h = 1.0f / 240;
};

template <int pass>
HWY_ATTR void sweep(BallJointRow<V>& row, BodiesV& bodies, V h) {
  solve_ball_joint<static_cast<JointPass>(pass)>(row, bodies, h, true);
}
template <int pass>
void sweep(fathom::BallJointRow<float>& row, JointBodies<SymMat3>& bodies, float h) {
  fathom::solve_ball_joint<static_cast<fathom::JointPass>(pass)>(row, bodies, h, true);
}
HWY_ATTR void warm_start(BallJointRow<V>& row, BodiesV& bodies) { warm_start_ball_joint(row, bodies); }
void warm_start(fathom::BallJointRow<float>& row, JointBodies<SymMat3>& bodies) {
  fathom::warm_start_ball_joint(row, bodies);
}

template <int pass>
HWY_ATTR void sweep(GenericJointRow<V>& row, BodiesV& bodies, V h) {
  solve_generic_joint<static_cast<JointPass>(pass)>(row, bodies, h, {true, true}, true);
}
template <int pass>
void sweep(fathom::GenericJointRow<float>& row, JointBodies<SymMat3>& bodies, float h) {
  fathom::solve_generic_joint<static_cast<fathom::JointPass>(pass)>(row, bodies, h, {true, true}, true);
}
HWY_ATTR void warm_start(GenericJointRow<V>& row, BodiesV& bodies) { warm_start_generic_joint(row, bodies); }
void warm_start(fathom::GenericJointRow<float>& row, JointBodies<SymMat3>& bodies) {
  fathom::warm_start_generic_joint(row, bodies);
}

template <int pass>
HWY_ATTR void sweep(CouplingRow<V>& row, BodiesV& bodies, V h) {
  solve_coupling<static_cast<JointPass>(pass)>(row, bodies, h, true);
}
template <int pass>
void sweep(fathom::CouplingRow<float>& row, JointBodies<SymMat3>& bodies, float h) {
  fathom::solve_coupling<static_cast<fathom::JointPass>(pass)>(row, bodies, h, true);
}
HWY_ATTR void warm_start(CouplingRow<V>& row, BodiesV& bodies) { warm_start_coupling(row, bodies); }
void warm_start(fathom::CouplingRow<float>& row, JointBodies<SymMat3>& bodies) {
  fathom::warm_start_coupling(row, bodies);
}

// The law of all passes, one after the other.
constexpr auto all_passes = [](auto& row, auto& bodies, auto h) HWY_ATTR {
  warm_start(row, bodies);
  sweep<0>(row, bodies, h);
  sweep<1>(row, bodies, h);
  sweep<2>(row, bodies, h);
};

TEST_F(LaneLaws, BallJoints) {
  compare<fathom::BallJointRow<float>, BallJointRow<V>>([&] { return ball(); }, all_passes);
}
TEST_F(LaneLaws, GenericJoints) {
  compare<fathom::GenericJointRow<float>, GenericJointRow<V>>([&] { return generic(); }, all_passes);
}
TEST_F(LaneLaws, Couplings) {
  compare<fathom::CouplingRow<float>, CouplingRow<V>>([&] { return coupling(); }, all_passes);
}

}  // namespace
}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
