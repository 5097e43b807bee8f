#include "native/solver.hpp"

#include <algorithm>
#include <cstring>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "dynamics/rotation.hpp"
#include "dynamics/softness.hpp"
#include "native/prefetch.hpp"
#include "world/growth.hpp"

namespace fathom::native {

namespace {

constexpr std::size_t alignment = 64;

float damping_factor(float damping, float h) { return 1.0f / (1.0f + h * damping); }

}  // namespace

ContactSolver::ContactSolver(const WorldDef& def, const BodyTable& bodies, BodyState& state, ContactGraph& graph,
                             ThreadPool& pool)
    : def_(def),
      bodies_(bodies),
      state_(state),
      graph_(graph),
      pool_(pool),
      wide_(wide_kernels()),
      single_(single_kernels()),
      layout_(state, graph, pool, static_cast<std::size_t>(wide_.width)) {}

// --- what there is to go over --------------------------------------------------------------------------------

class ContactSolver::Everything {
 public:
  explicit Everything(ContactSolver& solver) : s_(solver) {}

  template <class Act>
  void bodies(const Act& act) const {
    constexpr std::size_t ahead = 4;
    const bool scattered = s_.pool_.thread_count() > 1;  // otherwise they are in the order of memory
    const std::span<const std::uint32_t> slots = s_.layout_.bodies();
    s_.layout_.for_each_part_of_bodies([&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (scattered && i + ahead < end) prefetch(slots[i + ahead]);
        act(slots[i]);
      }
    });
  }

  /// The overflow, then colour by colour.
  template <class Kernel>
  void colours(const Kernel& kernel) const {
    if (s_.single_count_ > 0) kernel(s_.single_, s_.single_blocks_, 0, s_.single_count_);
    for (std::size_t i = 0; i < s_.layout_.stretches().size(); ++i)
      s_.layout_.for_each_part(
          i, [&](std::size_t begin, std::size_t end) { kernel(s_.wide_, s_.wide_blocks_, begin, end); });
  }

 private:
  void prefetch(std::uint32_t slot) const {
    prefetch_to_write(&s_.state_.solver_bodies()[slot]);
    prefetch_to_write(&s_.state_.warm[slot]);
    prefetch_to_read(&s_.state_.motion[slot]);
  }

  ContactSolver& s_;
};

class ContactSolver::OneGroup {
 public:
  OneGroup(ContactSolver& solver, const Group& group) : s_(solver), group_(group) {}

  template <class Act>
  void bodies(const Act& act) const {
    for (const std::uint32_t slot : s_.layout_.bodies(group_)) act(slot);
  }
  template <class Kernel>
  void colours(const Kernel& kernel) const {
    for (const auto& stretch : s_.layout_.stretches(group_))
      kernel(s_.wide_, s_.wide_blocks_, stretch.first, stretch.end);
  }

 private:
  ContactSolver& s_;
  const Group& group_;
};

template <class Act>
void ContactSolver::for_each_group(const Act& act) {
  const std::span<const Group> groups = layout_.groups();
  pool_.for_each_part(groups.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) act(groups[i]);
  });
}

// --- build ---------------------------------------------------------------------------------------------------

void ContactSolver::build(const BodiesInContact& in_contact, const Neighbourhood& neighbourhood) {
  const bool has_moved = layout_.update(in_contact, neighbourhood);
  const bool bounces = wide_blocks_.bounces != nullptr;
  if (has_moved || bounces != graph_.may_bounce() || block_bytes(wide_) != wide_blocks_.stride) make_room_for_blocks();
  point_count_ = 0;
  if (layout_.groups().empty()) {
    Everything(*this).bodies([&](std::uint32_t slot) { load_body(slot); });
    layout_.for_each_part_of_all([&](std::size_t begin, std::size_t end) { prepare(begin, end); });
    point_count_ += single_.prepare(single_blocks_, 0, single_count_, graph_.of_colour(overflow_colour).data(),
                                    graph_.constrained(), view());
  } else {
    for_each_group([&](const Group& group) {
      OneGroup(*this, group).bodies([&](std::uint32_t slot) { load_body(slot); });
      prepare(group.blocks.begin, group.blocks.end);
    });
  }
}

BodiesView ContactSolver::view() {
  return {state_.poses.data(), state_.solver_bodies(), state_.inertia.data(), state_.motion.data()};
}

void ContactSolver::prepare(std::size_t begin, std::size_t end) {
  point_count_ += wide_.prepare(wide_blocks_, begin, end, layout_.lanes(), graph_.constrained(), view());
}

void ContactSolver::load_body(std::uint32_t slot) {
  const BodyInfo& info = bodies_[slot];
  const Velocity& v = state_.velocities[slot];
  SolverBody& body = state_.solver_bodies()[slot];
  body = {v.linear, 0, v.angular, 0, {}, info.inverse_mass, {}, info.isotropic ? info.inverse_inertia.xx : 0};
  BodyMotion& motion = state_.motion[slot];
  motion = {};
  if (info.motion != MotionType::dynamic) return;
  const float h = def_.dt / static_cast<float>(def_.solver.substeps);
  motion.acceleration = info.gravity_scale * def_.gravity;
  motion.linear_damping = damping_factor(info.linear_damping, h);
  motion.angular_damping = damping_factor(info.angular_damping, h);
  const Quat q = state_.poses[slot].rotation;
  if (state_.flags[slot] & has_force) {
    const Force& f = state_.forces[slot];
    motion.acceleration = mul_add(motion.acceleration, info.inverse_mass, f.force);
    motion.angular_acceleration = rotate(q, info.inverse_inertia * inverse_rotate(q, f.torque));
  }
  if (!info.isotropic) {
    const SymMat3 world = rotated(to_matrix(q), info.inverse_inertia);
    state_.inertia[slot] = {world.xx, world.yy, world.zz, world.xy, world.xz, world.yz, 0, 0};
  }
}

std::size_t ContactSolver::block_bytes(const SolverKernels& kernels) const {
  return bodies_.any_anisotropic() ? kernels.block_bytes : kernels.isotropic_block_bytes;
}

void ContactSolver::make_room_for_blocks() {
  const std::size_t wide_count = layout_.blocks();
  single_count_ = graph_.of_colour(overflow_colour).size();
  wide_blocks_.stride = block_bytes(wide_);
  single_blocks_.stride = block_bytes(single_);
  const std::size_t bytes = wide_count * wide_blocks_.stride + single_count_ * single_blocks_.stride + alignment;
  if (blocks_.size() < bytes) {
    blocks_.clear();
    grow_to(blocks_, bytes);
  }
  const std::size_t misaligned = reinterpret_cast<std::uintptr_t>(blocks_.data()) % alignment;
  wide_blocks_.blocks = blocks_.data() + (misaligned ? alignment - misaligned : 0);
  single_blocks_.blocks = wide_blocks_.blocks + wide_count * wide_blocks_.stride;
  if (!graph_.may_bounce()) {
    wide_blocks_.bounces = single_blocks_.bounces = nullptr;
    return;
  }
  const std::size_t floats =
      wide_count * wide_.bounce_floats + single_count_ * single_.bounce_floats + alignment / sizeof(float);
  if (bounces_.size() < floats) grow_to(bounces_, floats);
  const std::size_t off = reinterpret_cast<std::uintptr_t>(bounces_.data()) % alignment;
  wide_blocks_.bounces = bounces_.data() + (off ? alignment - off : 0) / sizeof(float);
  single_blocks_.bounces = wide_blocks_.bounces + wide_count * wide_.bounce_floats;
}

// --- bodies --------------------------------------------------------------------------------------------------

// Quads as vectors: linear and angular parts go through the same operations, and the fourth elements stay zero.
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using QuadTag = hn::CappedTag<float, 4>;
using Quad = hn::Vec<QuadTag>;

HWY_INLINE Quad load(const Vec3& quad) { return hn::Load(QuadTag(), &quad.x); }
HWY_INLINE void put(Vec3& quad, Quad value) { hn::Store(value, QuadTag(), &quad.x); }

/// v ← damping · v + h · acceleration + W, with W brought up to date first (see the head of solver.hpp).
HWY_INLINE void integrate(Vec3& v, const Vec3& acceleration, float damping, float h, Vec3& warm, Vec3& reference,
                          bool first) {
  const QuadTag d;
  const Quad now = load(v);
  const Quad a = hn::IfThenElseZero(hn::FirstN(d, 3), load(acceleration));  // its fourth element is the damping
  const Quad w = first ? hn::Zero(d) : hn::Add(load(warm), hn::Sub(now, load(reference)));
  const Quad next = hn::Add(hn::MulAdd(hn::Set(d, h), a, hn::Mul(hn::Set(d, damping), now)), w);
  put(warm, w);
  put(v, next);
  put(reference, next);
}

}  // namespace

void ContactSolver::integrate_velocity(std::uint32_t slot, float h, bool first) {
  SolverBody& body = state_.solver_bodies()[slot];
  if (body.inverse_mass == 0) return;
  const BodyMotion& motion = state_.motion[slot];
  WarmStart& warm = state_.warm[slot];
  // The reference leaves the warm start out in the first substep, where a sweep applies it.
  integrate(body.linear, motion.acceleration, motion.linear_damping, h, warm.linear, warm.linear_reference, first);
  integrate(body.angular, motion.angular_acceleration, motion.angular_damping, h, warm.angular, warm.angular_reference,
            first);
}

namespace {

/// `fathom::mean_velocity` of a body in contact.
HWY_INLINE Quad mean_velocity(const SolverBody& body, const BodyMotion& motion, const WarmStart& warm, float h) {
  const QuadTag d;
  const Quad v = load(body.linear);
  const Quad acted = hn::Or(hn::Sub(v, load(warm.linear_reference)), load(warm.linear));
  if (!hn::AllTrue(d, hn::Eq(acted, hn::Zero(d)))) return v;
  return hn::NegMulAdd(hn::Set(d, 0.5f * h), hn::IfThenElseZero(hn::FirstN(d, 3), load(motion.acceleration)), v);
}

}  // namespace

void ContactSolver::integrate_position(std::uint32_t slot, float h) {
  const QuadTag d;
  SolverBody& body = state_.solver_bodies()[slot];
  put(body.moved,
      hn::MulAdd(hn::Set(d, h), mean_velocity(body, state_.motion[slot], state_.warm[slot], h), load(body.moved)));
  if (body.inverse_mass > 0 && body.inverse_inertia == 0) {
    // Anisotropic: the torque-free turn also changes the angular velocity, which is no contact's doing.
    const BodyInfo& info = bodies_[slot];
    const Vec3 before = body.angular;
    Quat q = state_.poses[slot].rotation;
    body.turned += step_torque_free(q, body.angular, info.inertia, info.inverse_inertia, h);
    // A body that fails keeps an orientation; its angular velocity tells that it failed.
    if (is_finite(q)) state_.poses[slot].rotation = q;
    state_.warm[slot].angular_reference += body.angular - before;
  } else {
    put(body.turned, hn::MulAdd(hn::Set(d, h), load(body.angular), load(body.turned)));
  }
}

// --- solve ---------------------------------------------------------------------------------------------------

void ContactSolver::solve() {
  if (layout_.groups().empty())
    solve(Everything(*this));
  else
    for_each_group([&](const Group& group) { solve(OneGroup(*this, group)); });
}

template <class Work>
void ContactSolver::solve(const Work& work) {
  const float h = def_.dt / static_cast<float>(def_.solver.substeps);
  if (def_.solver.method == Solver::soft)
    solve_soft(work, h);
  else
    solve_impulse(work, h);
}

template <class Work>
void ContactSolver::solve_soft(const Work& work, float h) {
  const SolverSettings& settings = def_.solver;
  const float hertz = min(settings.contact_hertz, 0.125f / h);
  SweepParameters soft;
  soft.inverse_substep = 1 / h;
  soft.dynamic = make_soft(hertz, settings.contact_damping_ratio, h);
  soft.fixed = make_soft(2 * hertz, settings.contact_damping_ratio, h);
  soft.push_out_velocity = settings.push_out_velocity;
  soft.restitution_threshold = settings.restitution_threshold;
  for (int substep = 0; substep < settings.substeps; ++substep) {
    work.bodies([&](std::uint32_t slot) { integrate_velocity(slot, h, substep == 0); });
    if (substep == 0) warm_start(work);
    sweep(work, &SolverKernels::solve, soft);
    work.bodies([&](std::uint32_t slot) { integrate_position(slot, h); });
    sweep(work, &SolverKernels::relax, soft);
  }
  if (graph_.may_bounce()) sweep(work, &SolverKernels::restitute, soft);
}

// Sequential impulses: λ' = −K⁻¹(Jv + b), accumulated and clamped, b from the penetration (dissertation, equations
// 3.20–3.23; Catto 2005 for the factor 0.2 of Baumgarte's b = β/Δt·C). Restitution follows as in the soft step.
template <class Work>
void ContactSolver::solve_impulse(const Work& work, float h) {
  constexpr float baumgarte = 0.2f;
  SweepParameters p;
  p.inverse_substep = 1 / h;
  p.dynamic.bias_rate = p.fixed.bias_rate = baumgarte / h;
  p.push_out_velocity = def_.solver.push_out_velocity;
  p.restitution_threshold = def_.solver.restitution_threshold;
  for (int substep = 0; substep < def_.solver.substeps; ++substep) {
    work.bodies([&](std::uint32_t slot) { integrate_velocity(slot, h, substep == 0); });
    if (substep == 0) warm_start(work);
    for (int i = 0; i < def_.solver.iterations; ++i) sweep(work, &SolverKernels::iterate, p);
    work.bodies([&](std::uint32_t slot) { integrate_position(slot, h); });
  }
  if (graph_.may_bounce()) sweep(work, &SolverKernels::restitute, p);
}

template <class Work>
void ContactSolver::warm_start(const Work& work) {
  work.colours([&](const SolverKernels& k, BlockArray blocks, std::size_t begin, std::size_t end) {
    k.warm_start(blocks, begin, end, state_.solver_bodies());
  });
}

template <class Work>
void ContactSolver::sweep(const Work& work, Sweep SolverKernels::*pass, const SweepParameters& parameters) {
  work.colours([&](const SolverKernels& k, BlockArray blocks, std::size_t begin, std::size_t end) {
    (k.*pass)(blocks, begin, end, state_.solver_bodies(), parameters);
  });
}

void ContactSolver::store() {
  const auto store_blocks = [&](std::size_t begin, std::size_t end) {
    wide_.store(wide_blocks_, begin, end, graph_.constrained());
  };
  if (layout_.groups().empty()) {
    layout_.for_each_part_of_all(store_blocks);
    single_.store(single_blocks_, 0, single_count_, graph_.constrained());
  } else {
    for_each_group([&](const Group& group) { store_blocks(group.blocks.begin, group.blocks.end); });
  }
}

}  // namespace fathom::native
