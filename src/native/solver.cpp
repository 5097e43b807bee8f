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

// The least work worth another thread, about half a microsecond.
constexpr std::size_t least_lanes = 32;
constexpr std::size_t least_bodies = 64;
constexpr std::size_t least_to_sort = 1024;
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
      single_(single_kernels()) {}

std::size_t ContactSolver::least_blocks() const {
  return std::max<std::size_t>(1, least_lanes / static_cast<std::size_t>(wide_.width));
}

// --- build ---------------------------------------------------------------------------------------------------

void ContactSolver::build(std::span<const std::uint32_t> in_contact, const Neighbourhood& neighbourhood) {
  lay_out_blocks(neighbourhood);
  share_out_bodies(in_contact, neighbourhood);
  for_each_body(in_contact, [&](std::uint32_t slot) { load_body(slot); });
  point_count_ = 0;
  const BodiesView view{state_.poses.data(), state_.solver_bodies(), state_.inertia.data(), state_.motion.data()};
  const Constrained constrained = graph_.constrained();
  for_each_share([&](std::size_t begin, std::size_t end) {
    point_count_ += wide_.prepare(wide_blocks_, begin, end, lanes_.data(), constrained, view);
  });
  point_count_ +=
      single_.prepare(single_blocks_, 0, single_count_, graph_.of_colour(overflow_colour).data(), constrained, view);
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

void ContactSolver::lay_out_blocks(const Neighbourhood& neighbourhood) {
  const bool isotropic = !bodies_.any_anisotropic();
  const std::size_t wide_bytes = isotropic ? wide_.isotropic_block_bytes : wide_.block_bytes;
  const std::size_t single_bytes = isotropic ? single_.isotropic_block_bytes : single_.block_bytes;
  const bool bounces = wide_blocks_.bounces != nullptr;
  if (laid_out_ == graph_.colouring() && bounces == graph_.may_bounce() && wide_bytes == wide_blocks_.stride) return;
  laid_out_ = graph_.colouring();
  wide_blocks_.stride = wide_bytes;
  single_blocks_.stride = single_bytes;
  const auto width = static_cast<std::size_t>(wide_.width);
  stretches_.clear();
  wide_count_ = 0;
  for (int colour = 0; colour < colour_count; ++colour) {
    const std::size_t contacts = graph_.of_colour(colour).size();
    if (contacts == 0) continue;
    stretches_.push_back({wide_count_, wide_count_ + (contacts + width - 1) / width, colour});
    wide_count_ = stretches_.back().end;
  }
  fill_lanes(neighbourhood);
  colours_in_use_ = static_cast<int>(stretches_.size());
  single_count_ = graph_.of_colour(overflow_colour).size();
  const std::size_t bytes = wide_count_ * wide_bytes + single_count_ * single_bytes + alignment;
  if (blocks_.size() < bytes) {
    blocks_.clear();
    grow_to(blocks_, bytes);
  }
  const std::size_t misaligned = reinterpret_cast<std::uintptr_t>(blocks_.data()) % alignment;
  wide_blocks_.blocks = blocks_.data() + (misaligned ? alignment - misaligned : 0);
  single_blocks_.blocks = wide_blocks_.blocks + wide_count_ * wide_bytes;
  if (!graph_.may_bounce()) {
    wide_blocks_.bounces = single_blocks_.bounces = nullptr;
    return;
  }
  const std::size_t floats =
      wide_count_ * wide_.bounce_floats + single_count_ * single_.bounce_floats + alignment / sizeof(float);
  if (bounces_.size() < floats) grow_to(bounces_, floats);
  const std::size_t off = reinterpret_cast<std::uintptr_t>(bounces_.data()) % alignment;
  wide_blocks_.bounces = bounces_.data() + (off ? alignment - off : 0) / sizeof(float);
  single_blocks_.bounces = wide_blocks_.bounces + wide_count_ * wide_.bounce_floats;
}

void ContactSolver::fill_lanes(const Neighbourhood& neighbourhood) {
  const auto width = static_cast<std::size_t>(wide_.width);
  grow_to(lanes_, wide_count_ * width);
  offsets_.resize(pool_.thread_count() > 1 ? stretches_.size() : 0);
  const auto fill = [&](std::size_t i) {
    const Stretch& stretch = stretches_[i];
    const std::vector<std::uint32_t>& contacts = graph_.of_colour(stretch.colour);
    const std::span<std::uint32_t> lanes{lanes_.data() + stretch.first * width, lanes_.data() + stretch.end * width};
    if (pool_.thread_count() > 1)
      offsets_[i] = neighbourhood.sort(
          contacts, [&](std::uint32_t contact) { return graph_[contact].b; }, lanes);
    else
      std::copy(contacts.begin(), contacts.end(), lanes.begin());
    std::fill(lanes.begin() + static_cast<std::ptrdiff_t>(contacts.size()), lanes.end(), none);
  };
  const bool alone = wide_count_ * width < least_to_sort;
  pool_.for_each_part(stretches_.size(), alone ? stretches_.size() : 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) fill(i);
  });
  share_out();
}

namespace {

/// The even cut, or the wanted one as far as shares stay nearly even: all threads wait for the largest.
std::size_t near_even(std::size_t even, std::size_t wanted, std::size_t share) {
  const std::size_t slack = share / 8;
  return std::clamp(wanted, even - std::min(even, slack), even + slack);
}

}  // namespace

// A thread's share is at the same places in every colour, as nearly as that leaves all with equal shares.
void ContactSolver::share_out() {
  const auto width = static_cast<std::size_t>(wide_.width), threads = static_cast<std::size_t>(pool_.thread_count());
  std::size_t total = 0;
  for (const Neighbourhood::Offsets& offsets : offsets_) total += offsets.back();
  place_cuts_.assign(threads + 1, Neighbourhood::place_count);
  for (std::size_t place = 0, t = 0; threads > 1 && place < Neighbourhood::place_count; ++place) {
    std::size_t before = 0;
    for (const Neighbourhood::Offsets& offsets : offsets_) before += offsets[place];
    while (t <= threads && before * threads >= t * total) place_cuts_[t++] = place;
  }
  cuts_.resize(stretches_.size() * (threads + 1));
  for (std::size_t s = 0; s < stretches_.size(); ++s) {
    Stretch& stretch = stretches_[s];
    const std::size_t blocks = stretch.end - stretch.first;
    stretch.shares = std::clamp<std::size_t>(blocks / least_blocks(), 1, threads);
    for (std::size_t t = 0; t <= threads; ++t) {
      const std::size_t even = std::min(t, stretch.shares) * blocks / stretch.shares;
      const bool inner = stretch.shares == threads && t > 0 && t < threads;
      const std::size_t cut =
          inner ? near_even(even, (offsets_[s][place_cuts_[t]] + width / 2) / width, blocks / threads) : even;
      cuts(s)[t] = stretch.first + cut;
    }
  }
}

void ContactSolver::share_out_bodies(std::span<const std::uint32_t> in_contact, const Neighbourhood& neighbourhood) {
  const auto threads = static_cast<std::size_t>(pool_.thread_count());
  const std::size_t shares = std::clamp<std::size_t>(in_contact.size() / least_bodies, 1, threads);
  body_cuts_.resize(shares + 1);
  for (std::size_t t = 0; t <= shares; ++t) {
    body_cuts_[t] = t * in_contact.size() / shares;
    if (shares < threads || threads == 1 || t == 0 || t == threads) continue;
    const auto wanted = std::partition_point(in_contact.begin(), in_contact.end(), [&](std::uint32_t slot) {
      return neighbourhood.place(slot) < place_cuts_[t];
    });
    body_cuts_[t] =
        near_even(body_cuts_[t], static_cast<std::size_t>(wanted - in_contact.begin()), in_contact.size() / threads);
  }
}

template <class Act>
void ContactSolver::for_each_share(const Act& act) {
  constexpr std::size_t parts = ThreadPool::parts_a_thread;
  const auto threads = static_cast<std::size_t>(pool_.thread_count());
  const std::size_t shares = std::clamp<std::size_t>(wide_count_ / least_blocks(), 1, parts * threads);
  // Too few for all: whole shares for some.
  if (shares < parts * threads) {
    pool_.for_each_part(wide_count_, least_blocks(), act);
    return;
  }
  pool_.for_each_part(shares, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = 0; s < stretches_.size(); ++s)
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t first = cuts(s)[i / parts], size = cuts(s)[i / parts + 1] - first;
        act(first + i % parts * size / parts, first + (i % parts + 1) * size / parts);
      }
  });
}

template <class Act>
void ContactSolver::for_each_body(std::span<const std::uint32_t> in_contact, const Act& act) {
  constexpr std::size_t ahead = 4;
  const bool scattered = pool_.thread_count() > 1;  // otherwise they are in the order of memory
  const auto prefetch = [&](std::uint32_t slot) {
    prefetch_to_write(&state_.solver_bodies()[slot]);
    prefetch_to_write(&state_.warm[slot]);
    prefetch_to_read(&state_.motion[slot]);
  };
  pool_.for_each_share(
      body_cuts_.size() - 1, [&](std::size_t t) { return body_cuts_[t]; },
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          if (scattered && i + ahead < end) prefetch(in_contact[i + ahead]);
          act(in_contact[i]);
        }
      });
}

// --- solve ---------------------------------------------------------------------------------------------------

void ContactSolver::solve(std::span<const std::uint32_t> in_contact) {
  const float h = def_.dt / static_cast<float>(def_.solver.substeps);
  if (def_.solver.method == Solver::soft)
    solve_soft(in_contact, h);
  else
    solve_impulse(in_contact, h);
}

void ContactSolver::solve_soft(std::span<const std::uint32_t> in_contact, float h) {
  const SolverSettings& settings = def_.solver;
  const float hertz = min(settings.contact_hertz, 0.125f / h);
  SweepParameters soft;
  soft.inverse_substep = 1 / h;
  soft.dynamic = make_soft(hertz, settings.contact_damping_ratio, h);
  soft.fixed = make_soft(2 * hertz, settings.contact_damping_ratio, h);
  soft.push_out_velocity = settings.push_out_velocity;
  soft.restitution_threshold = settings.restitution_threshold;
  for (int substep = 0; substep < settings.substeps; ++substep) {
    integrate_velocities(in_contact, h, substep == 0);
    if (substep == 0)
      for_each_colour([&](const SolverKernels& k, BlockArray blocks, std::size_t begin, std::size_t end) {
        k.warm_start(blocks, begin, end, state_.solver_bodies());
      });
    sweep(&SolverKernels::solve, soft);
    integrate_positions(in_contact, h);
    sweep(&SolverKernels::relax, soft);
  }
  if (graph_.may_bounce()) sweep(&SolverKernels::restitute, soft);
}

// Sequential impulses: λ' = −K⁻¹(Jv + b), accumulated and clamped, b from the penetration (dissertation, equations
// 3.20–3.23; Catto 2005 for the factor 0.2 of Baumgarte's b = β/Δt·C). Restitution follows as in the soft step.
void ContactSolver::solve_impulse(std::span<const std::uint32_t> in_contact, float h) {
  constexpr float baumgarte = 0.2f;
  SweepParameters p;
  p.inverse_substep = 1 / h;
  p.dynamic.bias_rate = p.fixed.bias_rate = baumgarte / h;
  p.push_out_velocity = def_.solver.push_out_velocity;
  p.restitution_threshold = def_.solver.restitution_threshold;
  for (int substep = 0; substep < def_.solver.substeps; ++substep) {
    integrate_velocities(in_contact, h, substep == 0);
    if (substep == 0)
      for_each_colour([&](const SolverKernels& k, BlockArray blocks, std::size_t begin, std::size_t end) {
        k.warm_start(blocks, begin, end, state_.solver_bodies());
      });
    for (int i = 0; i < def_.solver.iterations; ++i) sweep(&SolverKernels::iterate, p);
    integrate_positions(in_contact, h);
  }
  if (graph_.may_bounce()) sweep(&SolverKernels::restitute, p);
}

// Quads as vectors: linear and angular parts go through the same operations, and the fourth elements stay zero.
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using QuadTag = hn::CappedTag<float, 4>;
using Quad = hn::Vec<QuadTag>;

HWY_INLINE Quad load(const Vec3& quad) { return hn::Load(QuadTag(), &quad.x); }
HWY_INLINE void put(Vec3& quad, Quad value) { hn::Store(value, QuadTag(), &quad.x); }

/// v ← damping · v + h · acceleration + W, with W brought up to date first (see the head of solver.hpp).
HWY_INLINE void integrate_velocity(Vec3& v, const Vec3& acceleration, float damping, float h, Vec3& warm,
                                   Vec3& reference, bool first) {
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

void ContactSolver::integrate_velocities(std::span<const std::uint32_t> in_contact, float h, bool first) {
  for_each_body(in_contact, [&](std::uint32_t slot) {
    SolverBody& body = state_.solver_bodies()[slot];
    if (body.inverse_mass == 0) return;
    const BodyMotion& motion = state_.motion[slot];
    WarmStart& warm = state_.warm[slot];
    // The reference leaves the warm start out in the first substep, where a sweep applies it.
    integrate_velocity(body.linear, motion.acceleration, motion.linear_damping, h, warm.linear, warm.linear_reference,
                       first);
    integrate_velocity(body.angular, motion.angular_acceleration, motion.angular_damping, h, warm.angular,
                       warm.angular_reference, first);
  });
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

void ContactSolver::integrate_positions(std::span<const std::uint32_t> in_contact, float h) {
  const QuadTag d;
  for_each_body(in_contact, [&](std::uint32_t slot) {
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
  });
}

template <class Kernel>
void ContactSolver::for_each_colour(const Kernel& kernel) {
  if (single_count_ > 0) kernel(single_, single_blocks_, 0, single_count_);
  for (std::size_t s = 0; s < stretches_.size(); ++s)
    pool_.for_each_share(
        stretches_[s].shares, [&](std::size_t t) { return cuts(s)[t]; },
        [&](std::size_t begin, std::size_t end) { kernel(wide_, wide_blocks_, begin, end); });
}

void ContactSolver::sweep(Sweep SolverKernels::*pass, const SweepParameters& parameters) {
  for_each_colour([&](const SolverKernels& k, BlockArray blocks, std::size_t begin, std::size_t end) {
    (k.*pass)(blocks, begin, end, state_.solver_bodies(), parameters);
  });
}

void ContactSolver::store() {
  for_each_share(
      [&](std::size_t begin, std::size_t end) { wide_.store(wide_blocks_, begin, end, graph_.constrained()); });
  single_.store(single_blocks_, 0, single_count_, graph_.constrained());
}

}  // namespace fathom::native
