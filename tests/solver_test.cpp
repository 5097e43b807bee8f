// The constraint kernels against the textbook: sequential impulses written out in double precision, with anchors and
// Jacobians in world space and none of the kernels' algebra.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <tuple>

#include "dynamics/contact_rows.hpp"
#include "math/vec3d.hpp"
#include "native/solver_kernels.hpp"
#include "world_fixture.hpp"

namespace fathom::native::solver_test {
namespace {

struct Body {
  Vec3d linear, angular;
  double inverse_mass = 0;
  double inverse_inertia[3][3] = {};
};

Vec3d turn(const Body& body, Vec3d v) {
  const auto& m = body.inverse_inertia;
  return {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
          m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
}

/// A pair of bodies in contact, in the form of the kernels and in that of the textbook.
struct PairInContact {
  Pose poses[2];
  SolverBody solver[3];  // entry 0: no body
  WorldInertia inertias[2];
  Contact contact;
  ContactManifold manifold;
  Body a, b;
  Vec3d normal, tangent;
};

struct Textbook {
  PairInContact& pair;
  Vec3d arm_a[4], arm_b[4], centre_a, centre_b;
  double separation[4], impulse[4] = {}, friction[2] = {}, twist = 0, radius = 0;
  int count;

  explicit Textbook(PairInContact& p) : pair(p), count(p.manifold.point_count()) {
    const Vec3d between = to_double(p.poses[1].position) - to_double(p.poses[0].position);
    Vec3d sum{};
    double nearest = 1e30;
    for (int i = 0; i < count; ++i) {
      const Vec3d on_a = to_double(rotate(p.poses[0].rotation, p.manifold.points[i].anchor_a));
      const Vec3d on_b = between + to_double(rotate(p.poses[1].rotation, p.manifold.points[i].anchor_b));
      separation[i] = dot(on_b - on_a, p.normal);
      arm_a[i] = 0.5 * (on_a + on_b);
      nearest = std::min(nearest, separation[i]);
      impulse[i] = static_cast<double>(p.manifold.impulses[i]);
    }
    // Friction acts at the centre of the load or, while there is none, of the points that touch or nearly touch.
    const auto is_near = [&](int i) { return separation[i] <= nearest + static_cast<double>(friction_reach); };
    int near_count = 0;
    double load = 0, weight[4] = {};
    for (int i = 0; i < count; ++i)
      if (is_near(i)) load += impulse[i], ++near_count;
    for (int i = 0; i < count; ++i)
      if (is_near(i)) weight[i] = load > 0 ? impulse[i] / load : 1.0 / near_count;
    for (int i = 0; i < count; ++i) sum = sum + weight[i] * arm_a[i];
    centre_a = sum;
    centre_b = centre_a - between;
    for (int i = 0; i < count; ++i) {
      // The kernels project all points onto the plane through the centroid.
      const Vec3d from = arm_a[i] - centre_a;
      arm_a[i] = arm_a[i] - dot(from, p.normal) * p.normal;
      arm_b[i] = arm_a[i] - between;
      radius += static_cast<double>(patch_share) * weight[i] * length(arm_a[i] - centre_a);
    }
  }

  Vec3d relative_velocity(Vec3d ra, Vec3d rb) const {
    return pair.b.linear + cross(pair.b.angular, rb) - pair.a.linear - cross(pair.a.angular, ra);
  }
  double effective_k(Vec3d ra, Vec3d rb, Vec3d d, Vec3d e) const {
    return (pair.a.inverse_mass + pair.b.inverse_mass) * dot(d, e) + dot(cross(ra, d), turn(pair.a, cross(ra, e))) +
           dot(cross(rb, d), turn(pair.b, cross(rb, e)));
  }
  void push(Vec3d ra, Vec3d rb, Vec3d p) {
    pair.b.linear = pair.b.linear + pair.b.inverse_mass * p;
    pair.b.angular = pair.b.angular + turn(pair.b, cross(rb, p));
    pair.a.linear = pair.a.linear - pair.a.inverse_mass * p;
    pair.a.angular = pair.a.angular - turn(pair.a, cross(ra, p));
  }

  void sweep(const SweepParameters& parameters) {
    double total = 0;
    for (int i = 0; i < count; ++i) total += impulse[i];
    const double limit = static_cast<double>(pair.manifold.friction) * total;
    const Vec3d n = pair.normal, t1 = pair.tangent, t2 = cross(n, t1);

    const double k_twist = dot(n, turn(pair.a, n)) + dot(n, turn(pair.b, n));
    const double spin = dot(n, pair.b.angular - pair.a.angular), old_twist = twist;
    twist = std::clamp(twist - spin / k_twist, -limit * radius, limit * radius);
    pair.b.angular = pair.b.angular + (twist - old_twist) * turn(pair.b, n);
    pair.a.angular = pair.a.angular - (twist - old_twist) * turn(pair.a, n);

    const Vec3d slide = relative_velocity(centre_a, centre_b);
    const double k11 = effective_k(centre_a, centre_b, t1, t1), k12 = effective_k(centre_a, centre_b, t1, t2),
                 k22 = effective_k(centre_a, centre_b, t2, t2);
    const double det = k11 * k22 - k12 * k12, mass = 0.5 * (k11 + k22) / det;
    const double v1 = dot(t1, slide), v2 = dot(t2, slide);
    double f1 = friction[0] - (k22 * v1 - k12 * v2) / det, f2 = friction[1] - (k11 * v2 - k12 * v1) / det;
    // A patch that spins leaves less of its friction for sliding.
    const double along = std::hypot(mass * v1, mass * v2, limit);
    const double most = along > 0 ? limit * along / std::hypot(along, mass * radius * spin) : 0;
    const double size = std::hypot(f1, f2);
    if (size > most) f1 *= most / size, f2 *= most / size;
    push(centre_a, centre_b, (f1 - friction[0]) * t1 + (f2 - friction[1]) * t2);
    friction[0] = f1, friction[1] = f2;

    for (int i = 0; i < count; ++i) {
      const double bias = separation[i] > 0
                              ? separation[i] * static_cast<double>(parameters.inverse_substep)
                              : std::max(separation[i] * static_cast<double>(parameters.contacts.dynamic.bias_rate),
                                         -static_cast<double>(parameters.push_out_velocity));
      const double wanted =
          impulse[i] - (dot(n, relative_velocity(arm_a[i], arm_b[i])) + bias) / effective_k(arm_a[i], arm_b[i], n, n);
      const double change = std::max(wanted, 0.0) - impulse[i];
      impulse[i] += change;
      push(arm_a[i], arm_b[i], change * n);
    }
  }
};

/// Isotropic bodies or not; A fixed or not.
class Kernels : public testing::TestWithParam<std::tuple<bool, bool>> {
 protected:
  std::mt19937 random_{17};

  float uniform(float lo, float hi) { return lo + (hi - lo) * static_cast<float>(random_() >> 8) / 16777216.0f; }
  Vec3 vector(float size) { return {uniform(-size, size), uniform(-size, size), uniform(-size, size)}; }

  void make_body(int which, bool isotropic, PairInContact& p) {
    Body& body = which == 0 ? p.a : p.b;
    SolverBody& solver = p.solver[which + 1];
    p.poses[which] = {vector(1), 0, normalize(Quat{uniform(-1, 1), uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)})};
    const float inverse_mass = uniform(0.1f, 2);
    solver = {vector(3), 0, vector(3), 0, {}, inverse_mass, {}, 0};
    SymMat3 inverse{uniform(1, 5),        uniform(1, 5),        uniform(1, 5),
                    uniform(-0.4f, 0.4f), uniform(-0.4f, 0.4f), uniform(-0.4f, 0.4f)};
    if (isotropic) inverse = {inverse.xx, inverse.xx, inverse.xx, 0, 0, 0}, solver.inverse_inertia = inverse.xx;
    p.inertias[which] = {inverse.xx, inverse.yy, inverse.zz, inverse.xy, inverse.xz, inverse.yz, 0, 0, {}};
    body.linear = to_double(solver.linear), body.angular = to_double(solver.angular);
    body.inverse_mass = static_cast<double>(inverse_mass);
    const Mat3 m = to_matrix(inverse);
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        body.inverse_inertia[row][column] = static_cast<double>(m(row, column));
  }

  PairInContact make_pair(bool isotropic) {
    PairInContact p;
    make_body(0, isotropic, p);
    make_body(1, isotropic, p);
    ContactManifold& m = p.manifold;
    m.normal = normalize(vector(1));
    m.tangent = any_perpendicular(m.normal);
    m.friction = uniform(0.1f, 1);
    const int count = 1 + static_cast<int>(random_() % 4);
    const Pose b_in_a = relative(p.poses[0], p.poses[1]);
    for (int i = 0; i < count; ++i) {
      const Vec3 in_plane = vector(0.5f);
      const Vec3 on_a = 0.4f * m.normal + in_plane - dot(in_plane, m.normal) * m.normal;
      m.points[i].anchor_a = on_a;
      m.points[i].anchor_b = inverse_transform(b_in_a, on_a + uniform(-0.05f, 0.02f) * m.normal);
    }
    m.set_build(b_in_a, count);
    p.contact.a = 0, p.contact.b = 1, p.contact.manifold = 0, p.contact.in_use = true;
    p.normal = to_double(rotate(p.poses[0].rotation, m.normal));
    p.tangent = to_double(rotate(p.poses[0].rotation, m.tangent));
    return p;
  }

  /// A does not move whatever happens; its former inertia must not matter.
  static void fix_a(PairInContact& p) {
    p.contact.fixed_a = true;
    p.solver[1] = {};
    p.a = {};
  }

  static double error(Vec3 kernel, Vec3d textbook) { return length(to_double(kernel) - textbook); }
};

TEST_P(Kernels, IterateLikeTheTextbook) {
  const auto [isotropic, fixed_a] = GetParam();
  const SolverKernels& kernels = single_kernels();
  SweepParameters parameters;
  parameters.inverse_substep = 240;
  parameters.contacts.dynamic.bias_rate = parameters.contacts.fixed.bias_rate = 48;
  parameters.push_out_velocity = 3;
  alignas(64) std::byte block[4096] = {};
  ASSERT_LE(kernels.block_bytes, sizeof block);
  for (int trial = 0; trial < 2000; ++trial) {
    PairInContact p = make_pair(isotropic);
    if (fixed_a) fix_a(p);
    const std::uint32_t lane = 0;
    TouchChanges touches;
    touches.make_room(1);
    const Velocity velocities[2];
    const Constrained constrained{
        &p.contact, &p.manifold, nullptr, nullptr,
        nullptr,    nullptr,     nullptr, {&touches, p.poses, velocities, p.solver + 1, 1, 1}};
    const BlockArray array{block, nullptr, kernels.block_bytes};
    BodiesView view;
    view.poses = p.poses, view.bodies = p.solver + 1, view.inertias = p.inertias;
    kernels.prepare(array, 0, 1, &lane, constrained, view);
    Textbook textbook(p);
    for (int sweep = 0; sweep < 4; ++sweep) {
      kernels.iterate(array, 0, 1, p.solver + 1, parameters);
      textbook.sweep(parameters);
      ASSERT_LT(error(p.solver[1].linear, p.a.linear), 2e-3) << "trial " << trial << ", sweep " << sweep;
      ASSERT_LT(error(p.solver[2].linear, p.b.linear), 2e-3) << "trial " << trial << ", sweep " << sweep;
      ASSERT_LT(error(p.solver[1].angular, p.a.angular), 5e-3) << "trial " << trial << ", sweep " << sweep;
      ASSERT_LT(error(p.solver[2].angular, p.b.angular), 5e-3) << "trial " << trial << ", sweep " << sweep;
    }
    kernels.store(array, 0, 1, &lane, constrained, 1.0f, {});
    for (int i = 0; i < textbook.count; ++i)
      ASSERT_NEAR(static_cast<double>(p.manifold.impulses[i]), textbook.impulse[i], 5e-3) << "trial " << trial;
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, Kernels, testing::Combine(testing::Bool(), testing::Bool()),
                         [](const auto& parameter) {
                           return std::string(std::get<0>(parameter.param) ? "isotropic" : "general") +
                                  (std::get<1>(parameter.param) ? "_on_fixed" : "");
                         });

}  // namespace
}  // namespace fathom::native::solver_test
