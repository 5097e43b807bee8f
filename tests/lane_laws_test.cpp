// Laws over a lane type compute in each lane of a vector what they compute for one number (dynamics/*-inl.hpp), on
// random rows of contacts and joints. Vectors fuse the products of cross(), numbers do not, so the two are equal up to
// rounding.
#define HWY_DISABLE_PCLMUL_AES
#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

#include "dynamics/contact_rows.hpp"
#include "dynamics/generic_joint.hpp"
#include "native/contact_rows-inl.hpp"
#include "native/couplings-inl.hpp"
#include "random.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {
namespace {

using D = hn::CappedTag<float, 16>;
using V = hn::Vec<D>;
constexpr std::size_t width = hn::MaxLanes(D());

/// The floats of a row or a body, which have only floats and no padding: one number each, or a vector.
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

/// A contact, by number or by lanes: its manifold, and its rows. Only its numbers are stored in memory.
template <class L, class Vec, class Frame, class Axes, class Point, class Friction>
struct ContactOf {
  struct ManifoldOf {
    Vec normal_, tangent_, on_a_[max_manifold_points], on_b_[max_manifold_points], between_;
    L impulse_[max_manifold_points], used_[max_manifold_points], friction_;
    Friction friction_impulse_;
    struct Motion {
      Vec linear, angular;
      L inverse_mass;
    };
    struct {
      Motion a, b;
    } motion_;
    L half_step_, substeps_, curvature_, share_a_;

    static constexpr int end() { return max_manifold_points; }
    static constexpr bool has(int) { return true; }
    HWY_ATTR auto used(int i) const {
      if constexpr (std::is_same_v<L, float>)
        return used_[i] > 0;
      else
        return is_above(used_[i], splat<L>(0.0f));
    }
    Vec normal() const { return normal_; }
    Vec tangent() const { return tangent_; }
    Vec on_a(int i) const { return on_a_[i]; }
    Vec on_b(int i) const { return on_b_[i]; }
    Vec between() const { return between_; }
    L impulse(int i) const { return impulse_[i]; }
    L friction() const { return friction_; }
    Friction friction_impulse() const { return friction_impulse_; }
    template <class Bodies>
    HWY_ATTR void move_arms(Vec normal, L load, L gap, const Bodies& bodies, Vec& arm_a, Vec& arm_b) const {
      if constexpr (std::is_same_v<L, float>)
        fathom::move_arms_midway<L>({half_step_, substeps_, curvature_, share_a_}, load, gap, motion_, bodies, normal,
                                    arm_a, arm_b);
      else
        move_arms_midway<L>({half_step_, substeps_, curvature_, share_a_}, load, gap, motion_, bodies, normal, arm_a,
                            arm_b);
    }
  };
  ManifoldOf manifold;
  Frame frame;
  Point points[max_manifold_points];
  L impulses[max_manifold_points];
  Friction friction_impulses;
  L bounce, acceleration, overlap, nearest, held, given;
  L rolling_length;
  Vec rolling, surfaces;
  L grain_1, grain_2;

  static constexpr int end() { return max_manifold_points; }
  static constexpr bool has(int) { return true; }
  static constexpr bool may_bounce() { return true; }
  HWY_ATTR Axes axes() const { return Axes(frame); }
  auto response() const { return frame.response; }
  auto friction() const { return frame.friction; }
  Point point(int i) const { return points[i]; }
  L impulse(int i) const { return impulses[i]; }
  Friction friction_impulse() const { return friction_impulses; }
  L restitution() const { return bounce; }
  L pull() const { return acceleration; }
  void set_impulse(int i, L impulse) { impulses[i] = impulse; }
  void set_friction_impulse(const Friction& f) { friction_impulses = f; }
  void set_frame(const Axes& a) {
    frame.normal = a.n, frame.tangent = a.t1, frame.arm_a = a.arm_a, frame.arm_b = a.arm_b;
  }
  template <class Response>
  void set_response(const Response& k) {
    frame.response = k;
  }
  template <class Row>
  void set_friction(const Row& row) {
    frame.friction = row;
  }
  void set_point(int i, const Point& p) { points[i] = p; }
};
using Contact = ContactOf<float, Vec3, fathom::ContactFrameOf<float>, fathom::ContactAxesOf<float>,
                          fathom::ContactPoint<float>, fathom::FrictionImpulse<float>>;
using ContactV = ContactOf<V, Vec3V<V>, ContactFrameOf<V>, ContactAxesOf<V>, ContactPoint<V>, FrictionImpulse<V>>;

class LaneLaws : public testing::Test {
 protected:
  test::Generator random_{17};

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
  }
  fathom::BallJointRow<float> ball() {
    fathom::BallJointRow<float> row{};
    row.arm_a = vector(-1, 0.5f), row.arm_b = vector(-1, 0.5f), row.gap = vector(-3, -1);
    row.impulse = flag() * vector(-1, 0.5f), row.total = row.impulse, row.pull = flag() * vector(-1, 1);
    row.moment_a = flag() * vector(-1, 0.5f), row.moment_b = flag() * vector(-1, 0.5f);
    soften(row);
    row.rigid = flag(), row.compliance = (1 - row.rigid) * magnitude(-3, 3);
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
      axis.compliance = flag() * magnitude(-6, 1), axis.most = flag() * magnitude(-1, 2);
      axis.restitution = flag() * uniform(0, 1), axis.armature = flag() * magnitude(-3, 1);
    }
    for (int i = 0; i < axis_count; ++i) row.hold[i] = flag() * uniform(-3, 3), row.drive[i] = flag() * uniform(-1, 1);
    row.given = flag() * vector(-2, 1), row.moment_a = flag() * vector(-1, 0.5f),
    row.moment_b = flag() * vector(-1, 0.5f);
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
    row.rigid = flag(), row.compliance = (1 - row.rigid) * magnitude(-3, 3);
    row.lower = uniform(-5, 0), row.upper = uniform(0, 5), row.limited = flag();
    row.impulse = flag() * uniform(-10, 10);
    return row;
  }

  /// Up to four points on a patch, loaded or not. `extreme`: sizes, impulses and depths that differ by powers of ten,
  /// coincident points, friction and restitution of 0 or unusually high.
  Contact contact(bool extreme) {
    Contact c{};
    auto& m = c.manifold;
    const auto q = orientation();
    m.normal_ = rotate(Quat{q.w, q.v.x, q.v.y, q.v.z}, {1, 0, 0}),
    m.tangent_ = rotate({q.w, q.v.x, q.v.y, q.v.z}, {0, 1, 0});
    const Vec3 across = cross(m.normal_, m.tangent_), arm = vector(-1, extreme ? 1 : 0);
    const float size = extreme ? magnitude(-3, 1) : magnitude(-1, 0), push = extreme ? magnitude(-4, 3) : 1;
    m.between_ = vector(-1, 0.5f);
    for (int i = 0; i < max_manifold_points; ++i) {
      const bool coincides = extreme && random_() % 4 == 0;
      m.on_a_[i] = coincides ? arm : arm + size * (uniform(-1, 1) * m.tangent_ + uniform(-1, 1) * across);
      m.on_b_[i] = m.on_a_[i] + uniform(-1, 1) * (extreme ? magnitude(-5, 0) : 0.01f) * m.normal_;
      m.used_[i] = i == 0 ? 1.0f : flag(), m.impulse_[i] = m.used_[i] * flag() * push * uniform(0, 1);
    }
    m.friction_ = extreme ? flag() * magnitude(-3, 1) : uniform(0, 1);
    m.friction_impulse_ = {push * uniform(-1, 1), push * uniform(-1, 1), push * size * uniform(-1, 1)};
    m.motion_.a = {vector(-1, 1), vector(-1, extreme ? 3 : 1), flag()};
    m.motion_.b = {vector(-1, 1), vector(-1, extreme ? 3 : 1), 1};
    m.half_step_ = flag() / 120, m.substeps_ = 4, m.curvature_ = magnitude(-3, 0), m.share_a_ = uniform(-0.5f, 1.5f);
    m.share_a_ = clamp(m.share_a_, 0.0f, 1.0f);
    c.bounce = flag() * uniform(0, 1), c.acceleration = uniform(-10, 10), c.overlap = flag() * magnitude(-3, -1);
    c.held = flag() * uniform(0, 1), c.rolling_length = flag() * magnitude(-3, -1);
    c.rolling = flag() * vector(-2, 0), c.surfaces = flag() * vector(-1, 0.5f);
    const float grain = flag() * uniform(0, 1), towards = uniform(0, 2 * pi);
    c.grain_1 = grain * std::cos(towards), c.grain_2 = grain * std::sin(towards);
    return c;
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
    // A bound that is met up to rounding may be satisfied in one and not in the other.
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

// A contact's stages, by lanes and by number: its rows, warm starting, a restitution pass, a sweep over its points,
// friction on moving surfaces and kinematic bodies, and rolling.
HWY_ATTR void prepare(ContactV& c, const BodiesV& bodies) {
  c.nearest = prepare_contact_rows(c.manifold, c.overlap, bodies, c);
}
void prepare(Contact& c, const JointBodies<SymMat3>& bodies) {
  c.nearest = fathom::prepare_contact_rows(c.manifold, c.overlap, bodies, c);
}
HWY_ATTR void warm_start(ContactV& c, BodiesV& bodies) { warm_start_contact<V>(c, bodies); }
void warm_start(Contact& c, JointBodies<SymMat3>& bodies) { fathom::warm_start_contact<float>(c, bodies); }

HWY_ATTR void bounce(ContactV& c, BodiesV& bodies, V h) {
  c.given =
      bounce_contact(c, bodies, h, splat<V>(0.5f), [&](Vec3V<V> slide) HWY_ATTR { return slide + c.surfaces; }).impulse;
}
void bounce(Contact& c, JointBodies<SymMat3>& bodies, float h) {
  c.given = fathom::bounce_contact(c, bodies, h, 0.5f, [&](Vec3 slide) { return slide + c.surfaces; }).impulse;
}

template <int pass>
HWY_ATTR void push(ContactV& c, BodiesV& bodies, V h) {
  ContactStepOf<V> step{splat<V>(1.0f) / h, splat<V>(60.0f), splat<V>(0.7f),
                        splat<V>(0.3f),     splat<V>(4.0f),  support_slop(c.frame.friction.patch_radius)};
  stiffen(c.held, step), stiffen_uneven(bodies.a.inverse_mass, bodies.b.inverse_mass, step);
  solve_points<static_cast<ContactPass>(pass), true>(c, c.axes(), bodies, step);
}
template <int pass>
void push(Contact& c, JointBodies<SymMat3>& bodies, float h) {
  fathom::ContactStep step{1 / h, 60, 0.7f, 0.3f, 4, fathom::support_slop(c.frame.friction.patch_radius)};
  fathom::stiffen(c.held, step), fathom::stiffen_uneven(bodies.a.inverse_mass, bodies.b.inverse_mass, step);
  fathom::solve_points<static_cast<fathom::ContactPass>(pass), true>(c, c.axes(), bodies, step);
}

HWY_ATTR void rub(ContactV& c, BodiesV& bodies, V h) {
  const ContactAxesOf<V> axes = c.axes();
  sweep_friction(c, axes, bodies,
                 [&](Vec3V<V> slide) HWY_ATTR { return slide + carried_slide(bodies, axes, h) + c.surfaces; });
}
void rub(Contact& c, JointBodies<SymMat3>& bodies, float h) {
  const fathom::ContactAxes axes = c.axes();
  fathom::sweep_friction(c, axes, bodies,
                         [&](Vec3 slide) { return slide + fathom::carried_slide(bodies, axes, h) + c.surfaces; });
}

/// Friction that depends on direction.
HWY_ATTR void rub_along_grain(ContactV& c, BodiesV& bodies) {
  struct Effect {
    const ContactV& contact;
    HWY_ATTR Vec3V<V> operator()(Vec3V<V> slide) const { return slide + contact.surfaces; }
    HWY_ATTR bool limits_by_direction() const { return true; }
    HWY_ATTR FrictionImpulse<V> limited(V most, FrictionImpulse<V> wanted, FrictionImpulse<V>) const {
      return limited_to_ellipse(contact.grain_1, contact.grain_2, most, wanted);
    }
  };
  sweep_friction(c, c.axes(), bodies, Effect{c});
}
void rub_along_grain(Contact& c, JointBodies<SymMat3>& bodies) {
  const fathom::ContactSurface surface{c.surfaces, c.grain_1, c.grain_2};
  struct Effect : fathom::SurfaceEffect {
    bool limits_by_direction() const { return true; }
  };
  fathom::sweep_friction(c, c.axes(), bodies, Effect{{&surface}});
}

HWY_ATTR void roll(ContactV& c, BodiesV& bodies) {
  c.rolling = solve_rolling(bodies, c.rolling_length, total_impulse<V>(c), c.rolling);
}
void roll(Contact& c, JointBodies<SymMat3>& bodies) {
  c.rolling = fathom::solve_rolling(bodies, c.rolling_length, fathom::total_impulse<float>(c), c.rolling);
}

constexpr auto all_of_a_contact = [](auto& c, auto& bodies, auto h) HWY_ATTR {
  prepare(c, bodies);
  bounce(c, bodies, h);
  warm_start(c, bodies);
  push<0>(c, bodies, h);  // soft
  push<1>(c, bodies, h);  // relax
  rub(c, bodies, h);
  roll(c, bodies);
  rub_along_grain(c, bodies);
  rub(c, bodies, h);
  push<2>(c, bodies, h);  // of the solver `impulse`
};

// All passes, one after the other.
constexpr auto all_passes = [](auto& row, auto& bodies, auto h) HWY_ATTR {
  warm_start(row, bodies);
  sweep<0>(row, bodies, h);
  sweep<1>(row, bodies, h);
  sweep<2>(row, bodies, h);
};

// Rows without resistance share vectors with others, and brake not even a spin of a light body whose impulse has a
// square that underflows.
TEST_F(LaneLaws, RollingWithoutResistanceIsNothing) {
  Contact row = contact(false);
  row.rolling_length = 0, row.rolling = {};
  Side light{};
  light.angular = {1e-19f, -3e-20f, 2e-22f};
  light.inverse_mass = 100, light.response = {1e5f, 1e5f, 1e5f, 0, 0, 0};
  JointBodies<SymMat3> bodies{alone(Side{}), alone(light)};
  const Vec3 before = bodies.b.angular;
  roll(row, bodies);
  EXPECT_EQ(row.rolling, Vec3{});
  EXPECT_EQ(bodies.b.angular, before);
}

TEST_F(LaneLaws, BallJoints) {
  compare<fathom::BallJointRow<float>, BallJointRow<V>>([&] { return ball(); }, all_passes);
}
TEST_F(LaneLaws, GenericJoints) {
  compare<fathom::GenericJointRow<float>, GenericJointRow<V>>([&] { return generic(); }, all_passes);
}
TEST_F(LaneLaws, Couplings) {
  compare<fathom::CouplingRow<float>, CouplingRow<V>>([&] { return coupling(); }, all_passes);
}

TEST_F(LaneLaws, Contacts) {
  compare<Contact, ContactV>([&] { return contact(false); }, all_of_a_contact);
}
TEST_F(LaneLaws, ExtremeContacts) {
  compare<Contact, ContactV>([&] { return contact(true); }, all_of_a_contact);
}

}  // namespace
}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
