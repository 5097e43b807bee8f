// solve: all substeps in one kernel, whose phases are sweeps over colours and integrations over bodies.
//
// The same soft step as the native simulator's (native/solver.hpp), contact by contact with the functions of
// dynamics/contact_rows.hpp: warm starting once a step, later substeps carrying it in the bodies.
#pragma once

#include <fathom/world.hpp>
#include <type_traits>

#include "device/build_constraints.hpp"
#include "dynamics/rotation.hpp"
#include "exec/atomic.hpp"
#include "exec/kernel.hpp"
#include "exec/load.hpp"

namespace fathom::device {

/// `ConstraintHead::bits`: the number of points in the low bits, and
enum ConstraintBits : std::uint32_t {
  point_bits = 7,
  bounces_bit = 8,
  anisotropic_bit = 16,
  pushes_fixed_bit = 32,  ///< A cannot be pushed
};

// Constraints by component ---------------------------------------------------------------------------------------

/// Where the rows of constraint k begin; row r is 32·r quads further.
FATHOM_HD Quad* rows_of(const ConstraintArrays& c, std::uint32_t k) {
  return c.rows + (static_cast<std::size_t>(k / tile_width) * (row_count * tile_width) + k % tile_width);
}

FATHOM_HD void store_frame(Quad* rows, const ContactFrame& f) {
  rows[0] = {f.normal.x, f.normal.y, f.normal.z, f.tangent.x};
  rows[1 * tile_width] = {f.tangent.y, f.tangent.z, f.arm_a.x, f.arm_a.y};
  rows[2 * tile_width] = {f.arm_a.z, f.arm_b.x, f.arm_b.y, f.arm_b.z};
  rows[3 * tile_width] = {f.nn, f.n1, f.n2, f.k11};
  rows[4 * tile_width] = {f.k12, f.k22, f.friction, f.patch_radius};
  rows[5 * tile_width] = {f.slide_11, f.slide_12, f.slide_22, f.twist_mass};
}

FATHOM_HD ContactFrame frame_of(const Quad* q) {
  ContactFrame f;
  f.normal = {q[0].x, q[0].y, q[0].z};
  f.tangent = {q[0].w, q[1].x, q[1].y};
  f.arm_a = {q[1].z, q[1].w, q[2].x};
  f.arm_b = {q[2].y, q[2].z, q[2].w};
  f.nn = q[3].x, f.n1 = q[3].y, f.n2 = q[3].z, f.k11 = q[3].w;
  f.k12 = q[4].x, f.k22 = q[4].y, f.friction = q[4].z, f.patch_radius = q[4].w;
  f.slide_11 = q[5].x, f.slide_12 = q[5].y, f.slide_22 = q[5].z, f.twist_mass = q[5].w;
  return f;
}

FATHOM_HD void store_point(Quad* rows, int i, const PointRow& p) {
  rows[(first_point_row + static_cast<std::uint32_t>(i)) * tile_width] = {p.x, p.y, p.separation, p.mass};
}
FATHOM_HD void store_normal_impulses(Quad* rows, const ContactImpulses& p) {
  rows[impulse_row * tile_width] = {p.normal[0], p.normal[1], p.normal[2], p.normal[3]};
}
FATHOM_HD void store_friction_impulses(Quad* rows, const ContactImpulses& p) {
  rows[(impulse_row + 1) * tile_width] = {p.slide_1, p.slide_2, p.twist, p.step};
}

FATHOM_HD ContactImpulses impulses_of(const Quad* rows) {
  const Quad n = rows[impulse_row], f = rows[impulse_row + 1];
  ContactImpulses p;
  p.normal[0] = n.x, p.normal[1] = n.y, p.normal[2] = n.z, p.normal[3] = n.w;
  p.slide_1 = f.x, p.slide_2 = f.y, p.twist = f.z, p.step = f.w;
  return p;
}

// Bodies ---------------------------------------------------------------------------------------------------------

template <class Inertia>
FATHOM_HD Inertia world_inertia(const BodyArrays& bodies, std::uint32_t i, const SolverBody& body) {
  if constexpr (std::is_same_v<Inertia, float>) {
    return body.inverse_inertia;
  } else {
    if (body.inverse_mass == 0) return {};
    if (body.inverse_inertia > 0) return {body.inverse_inertia, body.inverse_inertia, body.inverse_inertia, 0, 0, 0};
    const WorldInertia w = bodies.inertia[i];
    return {w.xx, w.yy, w.zz, w.xy, w.xz, w.yz};
  }
}

template <class Inertia>
FATHOM_HD ContactBody<Inertia> contact_body(const BodyArrays& bodies, std::uint32_t i, const SolverBody& body) {
  return {body.linear, body.angular, body.inverse_mass, world_inertia<Inertia>(bodies, i, body)};
}

template <class Inertia>
FATHOM_HD void store_velocity(const BodyArrays& bodies, std::uint32_t i, const ContactBody<Inertia>& body) {
  bodies.solver[i].linear = body.linear;
  bodies.solver[i].angular = body.angular;
}

/// Rows of every constraint, from its manifold and its bodies.
struct PrepareConstraints {
  static constexpr std::uint32_t group_size = constraint_group_size;
  struct Local {
    std::uint32_t points;
  };

  BodyArrays bodies;
  ContactArrays contacts;
  ConstraintArrays constraints;
  Counters* counters;

  FATHOM_HD void operator()(auto group, Local& local) const {
    group.once([&] { local.points = 0; });
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t k = group.index() * group_size + item;
      if (k >= counters->constraints) return;
      prepare(k);
      exec::atomic_add(local.points, constraints.heads[k].bits & point_bits);
    });
    group.once([&] { exec::atomic_add(counters->points, local.points); });
  }

 private:
  FATHOM_HD void prepare(std::uint32_t k) const {
    const PairRecord pair = constraints.bodies[k];
    const SolverBody a = bodies.solver[pair.a], b = bodies.solver[pair.b];
    const auto anisotropic = [](const SolverBody& s) { return s.inverse_mass > 0 && s.inverse_inertia == 0; };
    if (anisotropic(a) || anisotropic(b))
      prepare<SymMat3>(k, pair, a, b, anisotropic_bit);
    else
      prepare<float>(k, pair, a, b, 0);
  }

  template <class Inertia>
  FATHOM_HD void prepare(std::uint32_t k, PairRecord pair, const SolverBody& solver_a, const SolverBody& solver_b,
                         std::uint32_t bits) const {
    const ContactManifold& m = contacts.manifolds[constraints.manifold[k]];
    const auto a = contact_body<Inertia>(bodies, pair.a, solver_a);
    const auto b = contact_body<Inertia>(bodies, pair.b, solver_b);
    ContactFrame frame;
    PointRow points[max_manifold_points];
    ContactImpulses impulses;
    prepare_contact(m, bodies.poses[pair.a], bodies.poses[pair.b], a, b, frame, points, impulses);
    const int count = m.point_count();
    Quad* const rows = rows_of(constraints, k);
    store_frame(rows, frame);
    for (int i = 0; i < max_manifold_points; ++i)
      if (i < count) store_point(rows, i, points[i]);
    store_normal_impulses(rows, impulses);
    store_friction_impulses(rows, impulses);
    if (m.restitution > 0) {
      bits |= bounces_bit;
      const ContactAxes f(frame);
      const NormalMotion before = f.motion(a.linear, a.angular, b.linear, b.angular);
      const Vec3 still;
      BounceRow row;
      row.pull = dot(f.n, (b.inverse_mass > 0 ? bodies.motion[pair.b].acceleration : still) -
                              (a.inverse_mass > 0 ? bodies.motion[pair.a].acceleration : still));
      for (int i = 0; i < max_manifold_points; ++i)
        if (i < count) row.approach[i] = before.at(points[i].x, points[i].y);
      constraints.bounces[k] = row;
    }
    if (contacts.contacts[constraints.contact[k]].fixed_a()) bits |= pushes_fixed_bit;
    constraints.heads[k] = {pair.a, pair.b, static_cast<std::uint32_t>(count) | bits, 0};
  }
};

struct SolveParameters {
  float h = 0;  ///< s, a substep
  std::uint32_t substeps = 4;
  std::uint32_t sweeps_before = 1;  ///< sweeps of a substep before positions move
  std::uint32_t sweeps_after = 1;   ///< and after
  bool soft = true;
  bool warm_start = true;  ///< else every substep begins without impulses
  ContactSoftness contacts;
  float push_out_velocity = 0, restitution_threshold = 0;
};

/// Coefficients of both solvers, as the native simulator has them.
inline SolveParameters solve_parameters(const WorldDef& def) {
  constexpr float baumgarte = 0.2f;  // Catto, "Iterative Dynamics with Temporal Coherence", 2005
  const SolverSettings& s = def.solver;
  SolveParameters p;
  p.substeps = static_cast<std::uint32_t>(s.substeps);
  p.h = def.dt / static_cast<float>(s.substeps);
  p.push_out_velocity = s.push_out_velocity;
  p.restitution_threshold = s.restitution_threshold;
  p.soft = s.method == Solver::soft;
  p.warm_start = s.warm_start;
  if (p.soft) {
    p.contacts = contact_softness(s, p.h);
  } else {
    p.sweeps_before = static_cast<std::uint32_t>(s.iterations);
    p.sweeps_after = 0;
    p.contacts.dynamic.bias_rate = p.contacts.fixed.bias_rate = baumgarte / p.h;
  }
  return p;
}

/// The phases of a step, each over one colour or over all bodies:
///
///     integrate velocities, warm start, then for each substep
///       sweeps, integrate positions, sweeps without bias, integrate velocities of the next substep
///     and restitution.
///
/// A constraint is always one work-item's, which therefore may load its rows and impulses while it waits for the phase
/// before; only bodies are read after the barrier.
struct SolveConstraints {
  static constexpr std::uint32_t group_size = 256;

  /// `push_first` is a push that begins without impulses.
  enum What : std::uint32_t { integrate_first_v, integrate_v, integrate_x, warm, push_first, push, relax, bounce };
  struct Place {
    What what;
    std::uint32_t colour;
    std::uint32_t round;  ///< integrations and sweeps over all colours within the substep, from the first `warm` on
    std::uint32_t substep;
  };

  struct Plan {
    Stretch schedule[schedule_size];
    std::uint32_t sweeps, overflow, bodies, bounces, columns;
  };
  static constexpr std::uint32_t plan_parts = schedule_size;

  /// A constraint's rows. Nothing has a default value here, which would be set before each load.
  struct Fetched {
    ConstraintHead head;
    Quad rows[row_count];
  };

  BodyArrays bodies;
  ContactArrays contacts;
  ConstraintArrays constraints;
  const Counters* counters;
  std::uint32_t body_capacity;
  SolveParameters p;

  FATHOM_HD void plan_part(Plan& plan, std::uint32_t k) const {
    plan.schedule[k] = counters->schedule[k];
    if (k > 0) return;
    plan.sweeps = counters->sweeps;
    plan.overflow = counters->overflow;
    plan.bodies = counters->live_bodies;
    plan.bounces = counters->may_bounce;
    plan.columns = counters->columns;
  }

  /// Where there are columns SolveWithColumns is due.
  FATHOM_HD std::uint32_t phases(const Plan& plan) const { return plan.columns ? 0 : all_phases(plan); }
  FATHOM_HD std::uint32_t all_phases(const Plan& plan) const {
    const std::uint32_t n = plan.sweeps;
    return n == 0 ? 0 : (p.warm_start ? n : 0) + p.substeps * of_substep(n) + (plan.bounces ? n : 0);
  }

  FATHOM_HD Place place(const Plan& plan, std::uint32_t phase) const {
    Place place{integrate_first_v, 0, 0, 0};
    for (std::uint32_t k = 0; k < phase; ++k) place = next(plan, place);
    return place;
  }

  FATHOM_HD Place next(const Plan& plan, Place place) const {
    if (is_sweep(place) && place.colour + 1 < plan.sweeps) {
      ++place.colour;
      return place;
    }
    place.colour = 0;
    if (place.what == integrate_first_v && p.warm_start) {
      place.what = warm;
      return place;
    }
    ++place.round;
    const std::uint32_t moving = 1 + p.sweeps_before, rounds = moving + 1 + p.sweeps_after;
    if (place.round == rounds) {
      place.round = 0;
      ++place.substep;
    }
    place.what = place.round < moving ? push : relax;
    if (place.round == 0) place.what = p.warm_start ? integrate_v : integrate_first_v;
    if (place.round == 1 && !p.warm_start) place.what = push_first;
    if (place.round == moving) place.what = integrate_x;
    if (place.substep == p.substeps) place.what = bounce;
    return place;
  }

  FATHOM_HD std::uint32_t items(const Plan& plan, Place place) const {
    if (!is_sweep(place)) return plan.bodies;
    return is_serial(plan, place) ? plan.overflow : plan.schedule[place.colour].count;
  }
  /// The overflow.
  FATHOM_HD bool is_serial(const Plan& plan, Place place) const {
    return is_sweep(place) && plan.overflow && place.colour == 0;
  }

  // All loads are made at once, whether the contact has that many points or not: none waits for another. What a sweep
  // does without is loaded from another row, which costs less than a branch.
  FATHOM_HD_INLINED void fetch(const Plan& plan, Place place, std::uint32_t i, Fetched& f) const {
    if (!is_sweep(place)) return;
    const std::uint32_t k = constraint(plan, place, i);
    const Quad* const rows = rows_of(constraints, k);
    const bool friction = with_friction(place.what);
    f.head = exec::load_unchanging(constraints.heads[k]);
    for (std::uint32_t r = 0; r < impulse_row; ++r)
      f.rows[r] = exec::load_unchanging(rows[(r == friction_row && !friction ? 0 : r) * tile_width]);
    f.rows[impulse_row] = rows[impulse_row * tile_width];
    f.rows[impulse_row + 1] = rows[(friction ? impulse_row + 1 : impulse_row) * tile_width];
  }

  FATHOM_HD_INLINED void operator()(const Plan& plan, Place place, std::uint32_t i, const Fetched& fetched) const {
    if (place.what == integrate_v || place.what == integrate_first_v)
      integrate_velocity(i, place.what == integrate_first_v);
    else if (place.what == integrate_x)
      integrate_position(i);
    else
      sweep(place, constraint(plan, place, i), fetched);
  }

 private:
  FATHOM_HD static bool is_sweep(Place place) { return place.what > integrate_x; }
  FATHOM_HD std::uint32_t constraint(const Plan& plan, Place place, std::uint32_t i) const {
    if (is_serial(plan, place)) return constraints.overflow_order[i];
    return plan.schedule[place.colour].first + i;
  }
  FATHOM_HD std::uint32_t of_substep(std::uint32_t n) const { return (p.sweeps_before + p.sweeps_after) * n + 2; }

  /// Whether a sweep needs more than the points' rows and impulses: friction, or the sum over the step.
  FATHOM_HD bool with_friction(What what) const { return what >= warm && !(what == push && p.soft); }

  /// Whether the sweep is its substep's last.
  FATHOM_HD bool ends_substep(Place place) const {
    return place.round == p.sweeps_before + (p.sweeps_after ? 1 + p.sweeps_after : 0);
  }

  FATHOM_HD_INLINED void sweep(Place place, std::uint32_t k, const Fetched& f) const {
    const bool last = ends_substep(place);
    if (place.what == push || place.what == push_first)
      sweep_as<push>(k, f, last, place.what == push_first);
    else if (place.what == relax)
      sweep_as<relax>(k, f, last);
    else if (place.what == warm)
      sweep_as<warm>(k, f, last);
    else if (f.head.bits & bounces_bit)
      sweep_as<bounce>(k, f, last);
  }

  template <What what>
  FATHOM_HD_INLINED void sweep_as(std::uint32_t k, const Fetched& f, bool last, bool from_zero = false) const {
    if (f.head.bits & anisotropic_bit)
      sweep_with<what, SymMat3>(k, f, last, from_zero);
    else
      sweep_with<what, float>(k, f, last, from_zero);
  }

  template <What what, class Inertia>
  FATHOM_HD_INLINED void sweep_with(std::uint32_t k, const Fetched& fetched, [[maybe_unused]] bool last,
                                    bool from_zero) const {
    const std::uint32_t bits = fetched.head.bits;
    const ConstraintHead& pair = fetched.head;
    const int count = static_cast<int>(bits & point_bits);
    const SolverBody solver_a = bodies.solver[pair.a], solver_b = bodies.solver[pair.b];
    const ContactFrame frame = frame_of(fetched.rows);
    const ContactAxes axes(frame);
    PointRow points[max_manifold_points];
    for (int i = 0; i < max_manifold_points; ++i) {
      const Quad q = fetched.rows[first_point_row + static_cast<std::uint32_t>(i)];
      points[i] = {q.x, q.y, q.z, q.w};
    }
    ContactImpulses impulses = impulses_of(fetched.rows);
    if (from_zero) impulses = impulses.cleared();
    Quad* const rows = rows_of(constraints, k);
    auto a = contact_body<Inertia>(bodies, pair.a, solver_a);
    auto b = contact_body<Inertia>(bodies, pair.b, solver_b);
    if constexpr (what == warm) {
      warm_start_contact(frame, axes, points, count, impulses, a, b);
    } else if constexpr (what == bounce) {
      const BounceRow row = constraints.bounces[k];
      restitute_contact(frame, axes, points, count, contacts.manifolds[constraints.manifold[k]].restitution,
                        p.restitution_threshold, row, impulses, a, b);
      store_normal_impulses(rows, impulses);
      store_friction_impulses(rows, impulses);
    } else {
      const NormalMotion moved = axes.motion(solver_a.moved, solver_a.turned, solver_b.moved, solver_b.turned);
      const bool fixed = bits & pushes_fixed_bit;
      ContactStep step{1 / p.h, fixed ? p.contacts.fixed : p.contacts.dynamic, p.push_out_velocity,
                       (bits & bounces_bit) != 0};
      if (is_uneven(solver_a.inverse_mass, solver_b.inverse_mass)) step.softness.impulse_scale *= uneven_share;
      if constexpr (what == relax) {
        // Here friction comes last: its limit is the impulse that carries the load, not the spring's.
        solve_points<ContactPass::relax>(frame, points, count, step, axes, moved, impulses, a, b);
        solve_friction(frame, axes, impulses, a, b);
      } else if (p.soft) {
        solve_points<ContactPass::soft>(frame, points, count, step, axes, moved, impulses, a, b);
      } else {
        solve_friction(frame, axes, impulses, a, b);
        solve_points<ContactPass::iterate>(frame, points, count, step, axes, moved, impulses, a, b);
      }
      store_normal_impulses(rows, impulses);
      if (last) impulses.step += impulses.sum();
      if (with_friction(what) || from_zero) store_friction_impulses(rows, impulses);
      if (bits & bounces_bit) keep_peaks(k, impulses);
    }
    store_velocity(bodies, pair.b, b);
    if (!(bits & pushes_fixed_bit)) store_velocity(bodies, pair.a, a);
  }

  FATHOM_HD void keep_peaks(std::uint32_t k, const ContactImpulses& impulses) const {
    BounceRow row = constraints.bounces[k];
    for (int i = 0; i < max_manifold_points; ++i) row.peak[i] = max(row.peak[i], impulses.normal[i]);
    constraints.bounces[k] = row;
  }

  /// v ← damping · v + h · acceleration + W, with W brought up to date first (native/solver.hpp).
  FATHOM_HD static void integrate(Vec3& v, Vec3 acceleration, float damping, float h, Vec3& warm_velocity,
                                  Vec3& reference, bool first) {
    warm_velocity = first ? Vec3{} : warm_velocity + (v - reference);
    v = mul_add(damping * v, h, acceleration) + warm_velocity;
    reference = v;
  }

  FATHOM_HD_INLINED void integrate_velocity(std::uint32_t i, bool first) const {
    if (bodies.touching[i] == 0) return;
    SolverBody body = bodies.solver[i];
    if (body.inverse_mass == 0) return;
    const BodyMotion motion = bodies.motion[i];
    WarmStart w;
    if (!first) w = bodies.warm[i];
    integrate(body.linear, motion.acceleration, motion.linear_damping, p.h, w.linear, w.linear_reference, first);
    integrate(body.angular, motion.angular_acceleration, motion.angular_damping, p.h, w.angular, w.angular_reference,
              first);
    bodies.warm[i] = w;
    bodies.solver[i].linear = body.linear;
    bodies.solver[i].angular = body.angular;
  }

  FATHOM_HD_INLINED void integrate_position(std::uint32_t i) const {
    if (bodies.touching[i] == 0 && bodies.constants[i].motion() != MotionType::kinematic) return;
    SolverBody body = bodies.solver[i];
    bool touched = true;
    if (body.inverse_mass > 0) {
      const WarmStart& w = bodies.warm[i];
      touched = !(body.linear == w.linear_reference && w.linear == Vec3{});
    }
    const Vec3 acceleration = touched ? Vec3{} : bodies.motion[i].acceleration;
    body.moved = mul_add(body.moved, p.h, mean_velocity(touched, body.linear, acceleration, p.h));
    if (body.inverse_mass > 0 && body.inverse_inertia == 0) {
      // Anisotropic: the torque-free turn also changes the angular velocity, which is no contact's doing.
      const BodyTensors t = bodies.tensors[i];
      const Vec3 before = body.angular;
      Quat q = bodies.poses[i].rotation;
      body.turned += step_torque_free(q, body.angular, t.inertia, t.inverse, p.h);
      // A body that fails keeps an orientation; its angular velocity tells that it failed.
      if (is_finite(q)) bodies.poses[i].rotation = q;
      bodies.warm[i].angular_reference += body.angular - before;
      bodies.solver[i].angular = body.angular;
    } else {
      body.turned = mul_add(body.turned, p.h, body.angular);
    }
    bodies.solver[i].moved = body.moved;
    bodies.solver[i].turned = body.turned;
  }
};

/// Hands the impulses back to the manifolds. One that is not finite is forgotten.
struct StoreImpulses {
  ContactArrays contacts;
  ConstraintArrays constraints;

  FATHOM_HD void operator()(std::uint32_t k) const {
    ContactManifold& m = contacts.manifolds[constraints.manifold[k]];
    const Quad* const rows = rows_of(constraints, k);
    const Quad n = rows[impulse_row * tile_width], f = rows[(impulse_row + 1) * tile_width];
    const float sum = ((n.x + n.y) + (n.z + n.w)) + ((f.x + f.y) + (f.z + f.w));
    const bool ok = is_finite(sum);
    m.impulses[0] = ok ? n.x : 0, m.impulses[1] = ok ? n.y : 0;
    m.impulses[2] = ok ? n.z : 0, m.impulses[3] = ok ? n.w : 0;
    m.friction_impulse[0] = ok ? f.x : 0, m.friction_impulse[1] = ok ? f.y : 0;
    m.twist_impulse = ok ? f.z : 0;
    m.step_impulse = ok ? f.w : 0;
  }
};

}  // namespace fathom::device
