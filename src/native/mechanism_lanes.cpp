// Compiled once per instruction set: with AVX-512 for its 32 registers and its masks, though lanes stay eight.

#define HWY_DISABLE_PCLMUL_AES
// As in solver_kernels.cpp.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL | HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "native/mechanism_lanes.cpp"
#include "native/mechanism_lanes.hpp"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <utility>

#include "check/check.hpp"
#include "dynamics/flatten.hpp"
#include "math/eight_rows.hpp"
#include "native/solver_kernels.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

namespace wide {

#define FATHOM_LANE_LAMBDA HWY_ATTR
#include "dynamics/lane_eight-inl.hpp"

/// Bodies of which only positions are used.
struct PlacedBodies {
  static constexpr bool all_isotropic = true;
  static constexpr bool only_pushes_b = false;

  struct Side {
    Vec3 linear, angular, moved, turned;
    Real inverse_inertia{};
  };
  Side a, b;

  static InverseInertia<Real, Real> inverse_of_a() { return {Real{}, Real{}}; }
  static InverseInertia<Real, Real> inverse_of_b() { return {Real{}, Real{}}; }
};

#define FATHOM_LANE_FUNCTION inline
#include "dynamics/joint_tree-inl.hpp"
// Its dependencies are included above.
#include "dynamics/joint_elimination-inl.hpp"
// Its dependencies are included above.
#include "dynamics/joint_link-inl.hpp"

/// Like JointImpulse.
struct BallImpulse {
  Vec3 last, total;
};

// Its dependencies are included above.
#include "dynamics/link_state-inl.hpp"
// Its dependencies are included above.
#include "dynamics/link_solver-inl.hpp"
#undef FATHOM_LANE_FUNCTION
#undef FATHOM_LANE_LAMBDA

}  // namespace wide

namespace {

using wide::Mask;
using wide::Real;

// --- lanes and their sources -------------------------------------------------------------------------------------

/// Copies words of `One`, each of which has eight lanes in `Many`.
template <class Many, class One>
struct LanesOf {
  static_assert(std::is_trivially_copyable_v<One> && std::is_trivially_copyable_v<Many>);
  static_assert(alignof(One) == 4 && sizeof(Many) == 8 * sizeof(One), "words alone, as long as a Real");
  static constexpr std::size_t words = sizeof(One) / 4, in_blocks = words / 8 * 8;

  static void gather(const std::array<const One*, 8>& from, Many& to) {
    for (std::size_t w = 0; w < in_blocks; w += 8) {
      Eight block[8];
      for (std::size_t lane = 0; lane < 8; ++lane) std::memcpy(&block[lane], word(*from[lane], w), sizeof(Eight));
      transpose(block);
      std::memcpy(word(to, 8 * w), block, sizeof(block));
    }
    for (std::size_t w = in_blocks; w < words; ++w)
      for (std::size_t lane = 0; lane < 8; ++lane) std::memcpy(word(to, 8 * w + lane), word(*from[lane], w), 4);
  }
  static void scatter(const Many& from, const std::array<One*, 8>& to, std::size_t count) {
    for (std::size_t w = 0; w < in_blocks; w += 8) {
      Eight block[8];
      std::memcpy(block, word(from, 8 * w), sizeof(block));
      transpose(block);
      for (std::size_t lane = 0; lane < count; ++lane) std::memcpy(word(*to[lane], w), &block[lane], sizeof(Eight));
    }
    for (std::size_t w = in_blocks; w < words; ++w)
      for (std::size_t lane = 0; lane < count; ++lane) std::memcpy(word(*to[lane], w), word(from, 8 * w + lane), 4);
  }
  static void take_out(const Many& from, std::size_t lane, One& to) {
    for (std::size_t w = 0; w < words; ++w) std::memcpy(word(to, w), word(from, 8 * w + lane), 4);
  }
  static void bring_back(const One& from, std::size_t lane, Many& to) {
    for (std::size_t w = 0; w < words; ++w) std::memcpy(word(to, 8 * w + lane), word(from, w), 4);
  }

 private:
  // By bytes, because words are floats or integers.
  template <class T>
  static unsigned char* word(T& of, std::size_t w) {
    return reinterpret_cast<unsigned char*>(&of) + 4 * w;
  }
  template <class T>
  static const unsigned char* word(const T& of, std::size_t w) {
    return reinterpret_cast<const unsigned char*>(&of) + 4 * w;
  }
};
using States = LanesOf<wide::LinkState, LinkState>;
using Joints = LanesOf<wide::JointLink, JointLink>;
using Pushes = LanesOf<wide::LinkPushes, LinkPushes>;
using Impulses = LanesOf<wide::GenericImpulseOf<Real>, GenericImpulse>;
using Definitions = LanesOf<wide::GenericJointDefinition<Real>, GenericJointDefinition<float>>;
using BallImpulses = LanesOf<wide::BallImpulse, JointImpulse>;

/// A batch's memory.
struct BatchMemory {
  wide::LinkState* states;
  wide::LinkPushes* pushes;
  wide::JointLink* generic;
  wide::LinkLimits* limits;  // of generic joints, as of the start of a solution
  wide::JointVector* ahead;  // where their axes would end without the solution
  EightInts* slots;          // of links' bodies

  BatchMemory(void* memory, std::uint32_t links, std::uint32_t joints)
      : states(static_cast<wide::LinkState*>(memory)),
        pushes(reinterpret_cast<wide::LinkPushes*>(states + links)),
        generic(reinterpret_cast<wide::JointLink*>(pushes + links)),
        limits(reinterpret_cast<wide::LinkLimits*>(generic + joints)),
        ahead(reinterpret_cast<wide::JointVector*>(limits + joints)),
        slots(reinterpret_cast<EightInts*>(ahead + joints)) {}
};

std::uint32_t generic_joints(const Mechanism& m, const MechanismLink* links) {
  return static_cast<std::uint32_t>(std::count_if(
      links + m.first, links + m.end, [](const MechanismLink& l) { return l.generic != MechanismLink::none; }));
}
std::uint32_t first_generic(const Mechanism& m, const MechanismLink* links) {
  const MechanismLink* const found = std::find_if(
      links + m.first, links + m.end, [](const MechanismLink& l) { return l.generic != MechanismLink::none; });
  return found == links + m.end ? 0 : found->generic;
}

// --- links in lanes ----------------------------------------------------------------------------------------------

/// Like MechanismSolver's access, with links numbered as in the first lane's mechanism.
struct LaneAccess {
  struct Body {
    wide::Vec3 linear, angular, moved, turned;
    Real inverse_mass, inverse_inertia;
  };
  struct Limits {
    Real linear, angular;
  };

  BatchMemory memory;
  std::uint32_t first_link, first_joint;
  SolverBody* bodies;
  const WorldInertia* inertias;
  float push_out;
  SpeedLimits speed_limits;
  LaneBits counts;  // lanes whose bodies get velocities

  wide::LinkState& state(std::uint32_t i) const { return memory.states[i - first_link]; }
  wide::JointLink& generic(std::uint32_t number) const { return memory.generic[number - first_joint]; }
  wide::JointVector& first_ahead(std::uint32_t number) const { return memory.ahead[number - first_joint]; }
  wide::LinkPushes& pushes(std::uint32_t i) const { return memory.pushes[i - first_link]; }
  Body body(std::uint32_t i, const MechanismLink&) const { return body_at(memory.slots[i - first_link]); }
  Body body_at(EightInts slots) const {
    Eight lower[8], upper[8];
    for (int lane = 0; lane < 8; ++lane) {
      const float* const from = reinterpret_cast<const float*>(&bodies[slots[lane]]);
      lower[lane] = load_row(from), upper[lane] = load_row(from + 8);
    }
    transpose(lower), transpose(upper);
    return {{lower[0], lower[1], lower[2]},
            {lower[4], lower[5], lower[6]},
            {upper[0], upper[1], upper[2]},
            {upper[4], upper[5], upper[6]},
            upper[3],
            upper[7]};
  }
  void set_velocity(std::uint32_t i, const MechanismLink&, const wide::Vec3& linear, const wide::Vec3& angular) const {
    const Eight zero = eight(0.0f);
    Eight rows[8] = {linear.x, linear.y, linear.z, zero, angular.x, angular.y, angular.z, zero};
    transpose(rows);
    for (int lane = 0; lane < 8; ++lane)
      if (counts >> lane & 1u) store_row(rows[lane], reinterpret_cast<float*>(&bodies[slot(i, lane)]));
  }
  void add_velocity(std::uint32_t i, const MechanismLink& link, const wide::Vec3& linear,
                    const wide::Vec3& angular) const {
    const Body now = body(i, link);
    set_velocity(i, link, now.linear + linear, now.angular + angular);
  }
  wide::SymMat3 response(std::uint32_t i, const MechanismLink& link) const {
    const Real isotropic = body(i, link).inverse_inertia, zero = eight(0.0f);
    if (wide::everywhere(state(i).is_isotropic)) return {isotropic, isotropic, isotropic, zero, zero, zero};
    Eight rows[8];
    for (int lane = 0; lane < 8; ++lane) rows[lane] = load_row(&inertias[slot(i, lane)].xx);
    transpose(rows);
    return {rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]};
  }
  Real push_out_velocity() const { return eight(push_out); }
  Limits limits(Real) const { return {eight(speed_limits.linear), eight(speed_limits.angular)}; }

 private:
  std::uint32_t slot(std::uint32_t i, int lane) const {
    return static_cast<std::uint32_t>(memory.slots[i - first_link][lane]);
  }
};

/// The common work of a substep, for all lanes at once.
struct LaneSolver : wide::LinkSolver<LaneAccess> {
  const Mechanism& m;
  Real h;

  template <class Act>
  void each(const Act& act) const {
    for (std::uint32_t i = m.first; i < m.end; ++i) act(i);
  }
  template <class Test>
  Mask all(const Test& test) const {
    Mask holds = wide::all_set;
    for (std::uint32_t i = m.first; i < m.end; ++i) holds = holds & test(i);
    return holds;
  }

  void turn_all(bool relaxes) const {
    each([&](std::uint32_t i) { turn(i); });
    each([&](std::uint32_t i) { turn_joint(i, relaxes); });
  }
  void take_back() const {
    each([&](std::uint32_t i) { turn_back(i); });
    each([&](std::uint32_t i) { choose_coordinates(i); });
  }
  // Links follow each other level by level.
  void eliminate_all() const {
    for (std::uint32_t i = m.end; i-- > m.first;) eliminate(i);
  }
  template <wide::LinkPass pass = wide::LinkPass::aimed>
  void substitute(Mask counts) const {
    for (std::uint32_t i = m.end; i-- > m.first;) hand_on<pass>(i);
    each([&](std::uint32_t i) { follow_parent<pass>(i, counts); });
  }
  void look_all_ahead() const {
    each([&](std::uint32_t i) { look_ahead(i, h); });
  }
  void aim_all_ahead() const {
    each([&](std::uint32_t i) { aim_ahead(i, h); });
  }
  Mask revise_all(Mask asks) const {
    Mask changes = Mask{};
    if (!wide::anywhere(asks)) return changes;
    each([&](std::uint32_t i) { changes = changes | revise(i, h, asks); });
    return changes;
  }
  /// Lanes of `asks` in which a drive exceeds its largest force.
  Mask overdrive(Mask asks, bool motors_only = false) const {
    if (!wide::anywhere(asks)) return Mask{};
    return asks & ~all([&](std::uint32_t i) { return ~overdrives(i, motors_only); });
  }
  /// Puts drives that exceed their largest force at it. Returns the lanes where there are any.
  Mask restrain_all() const {
    Mask changes = Mask{};
    each([&](std::uint32_t i) { changes = changes | restrain(i, false); });
    return changes;
  }
  /// Lanes in which the substep can follow the swings of all links whose elimination is new.
  Mask can_follow_changed() const {
    return all([&](std::uint32_t i) {
      return wide::anywhere(state(i).is_changed) ? can_follow(i, h) : wide::is_set(wide::all_set);
    });
  }
  /// At motions that every first round of a solution begins with.
  void look_all_ahead_first(bool is_first) const {
    look_all_ahead();
    each([&](std::uint32_t i) {
      if (!has_generic(i)) return;
      wide::JointVector& ahead = access.first_ahead(links[i].generic);
      if (!is_first) return generic(i).know_ahead(ahead);
      generic(i).look_ahead(pair_of(i), h);
      std::memcpy(ahead, generic(i).ahead(), sizeof(ahead));
    });
  }
  void take_first_round(bool is_first) const {
    look_all_ahead_first(is_first);
    aim_all_ahead();
    substitute(wide::all_set);
    look_all_ahead();
  }
  /// Further rounds in the lanes of `go`, each lane as long as a round helps. Returns the lanes that had one.
  Mask take_more_rounds(Mask go) const {
    Mask went = Mask{};
    for (int round = 1; round < newton_rounds; ++round) {
      aim_all_ahead();
      go = go & ~all([&](std::uint32_t i) { return is_aimed_within(i, eight(aimed_share), h); });
      if (!wide::anywhere(go)) break;
      substitute(go);
      look_all_ahead();
      went = went | go;
    }
    return went;
  }
  /// Like MechanismSolver's, with look-ahead. Of the lanes `done_here`, returns those in which the substep can follow
  /// all swings and no drive exceeds its largest force. Lanes wait for those that need other limits: solving them again
  /// gives the same result. All lanes have their first round with the limits they need before any takes further ones,
  /// so that none is repeated for others.
  Mask solve_with_limits(Mask done_here) const {
    Mask agrees = Mask{}, is_done = Mask{};  // the first round needs no other limits; nor do the further ones
    Real revisions{};
    const auto begin_again = [&](Mask changes) {
      revisions += select(changes, eight(1.0f), Real{});
      take_back();
    };
    for (bool is_first = true;; is_first = false) {
      eliminate_all();
      done_here =
          done_here & (is_first ? all([&](std::uint32_t i) { return can_follow(i, h); }) : can_follow_changed());
      each([&](std::uint32_t i) { load_carried(i); });
      take_first_round(is_first);
      const Mask spent = ~(revisions < eight(static_cast<float>(max_revisions)));
      done_here = done_here & ~overdrive(done_here & spent);
      const Mask may_revise = done_here & ~spent;
      if (const Mask changes = revise_all(may_revise & ~agrees); wide::anywhere(changes)) {
        agrees = ~changes;
        begin_again(changes);
        continue;
      }
      const Mask went = take_more_rounds(done_here);
      const Mask changes = revise_all(may_revise & went & ~is_done);
      if (!wide::anywhere(changes)) return done_here & ~overdrive(done_here & spent);
      agrees = is_done = ~changes;
      begin_again(changes);
    }
  }
};

/// Implements MechanismLanes.
class LaneBatch {
 public:
  LaneBatch(const MechanismWorld& world, const MechanismBatch& batch) : world_(world), batch_(batch) {}

  void take_out(LaneBits lanes) const;
  void bring_back(LaneBits lanes) const;
  void prepare() const;
  void store() const;
  LaneBits warm_start(float h) const;
  LanesAlone pull_together(float h) const;
  LaneBits relax(float h) const;

 private:
  struct Work;
  struct Start;
  /// Lanes whose mechanisms solve contacts.
  LaneBits loaded() const;
  template <bool soft>
  void sweep_contacts(const Work& work, LaneBits lanes, float h) const;
  void store_impulses(LaneBits lanes, bool ends_substep) const;
  void take_back_contacts(LaneBits lanes) const;
  /// Those of the lowest lane.
  LinkContactRange contacts_of(LaneBits lanes) const;
  template <class Act>
  void each_lane(LaneBits lanes, const Act& act) const;
  const Mechanism& mechanism(std::uint32_t lane) const { return world_.mechanisms[batch_.numbers[lane]]; }

  const MechanismWorld& world_;
  const MechanismBatch& batch_;
};

/// A batch being solved.
struct LaneBatch::Work {
  const Mechanism& first;
  std::uint32_t links, generic, first_generic;
  BatchMemory memory;
  LaneBits in_use;

  explicit Work(const LaneBatch& lanes)
      : first(lanes.mechanism(0)),
        links(first.end - first.first),
        generic(generic_joints(first, lanes.world_.links)),
        first_generic(HWY_NAMESPACE::first_generic(first, lanes.world_.links)),
        memory(lanes.batch_.memory, links, generic),
        in_use((1u << lanes.batch_.numbers.size()) - 1) {}

  /// kg, of each lane's mechanism.
  Eight masses(const LaneBatch& lanes) const {
    Eight masses = eight(first.mass);
    for (std::uint32_t lane = 1; lane < lanes.batch_.numbers.size(); ++lane) masses[lane] = lanes.mechanism(lane).mass;
    return masses;
  }
  LaneSolver solver(const LaneBatch& lanes, float h) const {
    const MechanismWorld& w = lanes.world_;
    return {{{memory, first.first, first_generic, w.state.solver_bodies(), w.state.inertia.data(), w.push_out, w.limits,
              in_use},
             w.links},
            first,
            eight(h)};
  }
};

/// What the links of a batch begin a step with.
struct LaneBatch::Start {
  const MechanismWorld& world;
  const LaneSolver& solver;
  std::array<const MechanismLink*, 8> lanes;  ///< the current link in each of them

  template <class Number>
  EightInts each(const Number& number) const {
    EightInts numbers;
    for (std::size_t lane = 0; lane < 8; ++lane) numbers[lane] = static_cast<std::int32_t>(number(*lanes[lane]));
    return numbers;
  }
  template <class Vector>
  wide::Vec3 vectors(const Vector& vector) const {
    wide::Vec3 vectors;
    for (std::size_t lane = 0; lane < 8; ++lane) {
      const Vec3 v = vector(*lanes[lane]);
      vectors.x[lane] = v.x, vectors.y[lane] = v.y, vectors.z[lane] = v.z;
    }
    return vectors;
  }
  struct Rows {
    Eight of[8];

    Eight operator[](std::size_t word) const { return of[word]; }
  };
  /// The eight words from each lane's item on.
  template <class Item>
  static Rows rows(const Item& item) {
    Rows rows;
    for (std::int32_t lane = 0; lane < 8; ++lane) rows.of[lane] = load_row(reinterpret_cast<const float*>(item(lane)));
    transpose(rows.of);
    return rows;
  }

  wide::LinkStart body(EightInts slots) const {
    const auto at = rows([&](std::int32_t lane) { return &world.state.poses[slots[lane]]; });
    const LaneAccess::Body body = solver.access.body_at(slots);
    return {{at[0], at[1], at[2]}, {at[4], {at[5], at[6], at[7]}}, body.linear, body.angular};
  }
  void begin_body(std::uint32_t i, EightInts slots, const wide::LinkStart& body) const {
    const auto info = [&](std::int32_t lane) -> const BodyInfo& { return world.bodies[slots[lane]]; };
    // Two words of the member after it come along, unused.
    static_assert(offsetof(BodyInfo, inverse_inertia) == offsetof(BodyInfo, inertia) + 6 * sizeof(float));
    const auto inertia = rows([&](std::int32_t lane) { return &info(lane).inertia; });
    EightInts is_isotropic;
    Eight inverse_mass;
    for (std::int32_t lane = 0; lane < 8; ++lane)
      is_isotropic[lane] = flag(info(lane).isotropic), inverse_mass[lane] = info(lane).inverse_mass;
    FATHOM_ASSERT(bits(is_isotropic) == 0 || bits(is_isotropic) == 0xff);  // must be the same in all lanes
    const Eight mass = 1.0f / solver.access.body_at(slots).inverse_mass, share = mass * inverse_mass;
    solver.begin_body(i, mass,
                      {share * inertia[0], share * inertia[1], share * inertia[2], share * inertia[3],
                       share * inertia[4], share * inertia[5]},
                      body, is_isotropic);
  }
  void begin_joint(std::uint32_t i, const MechanismLink& link, const wide::LinkStart& body,
                   const wide::LinkStart& parent) const {
    const auto joint = [&](std::int32_t lane) { return lanes[lane]->joint; };
    static_assert(offsetof(Joint, anchor_a) == 8 && offsetof(Joint, anchor_b) == 20);
    const auto ends = rows([&](std::int32_t lane) { return &world.constrained.joints[joint(lane)]; });
    const wide::Vec3 on_a{ends[2], ends[3], ends[4]}, on_b{ends[5], ends[6], ends[7]};
    const wide::Vec3 anchor = link.is_b ? on_b : on_a, parent_anchor = link.is_b ? on_a : on_b;
    const wide::Vec3 pull = vectors([&](const MechanismLink& l) {
      const bool hangs = l.parent == MechanismLink::none;
      return world.state.swing(l.body) - (hangs ? Vec3{} : world.state.swing(world.links[l.parent].body));
    });
    if (link.generic == MechanismLink::none) {
      const wide::Vec3 last =
          vectors([&](const MechanismLink& l) { return world.constrained.joint_impulses[l.joint].last; });
      return solver.begin_ball(i, body, parent, anchor, parent_anchor, pull, last);
    }
    std::array<const GenericJointDefinition<float>*, 8> definitions;
    std::array<const GenericImpulse*, 8> impulses;
    for (std::int32_t lane = 0; lane < 8; ++lane) {
      definitions[lane] = &world.constrained.generic_joints[joint(lane)];
      impulses[lane] = &world.constrained.generic_impulses[joint(lane)];
    }
    wide::GenericJointDefinition<Real> definition;
    wide::GenericImpulseOf<Real> impulse;
    Definitions::gather(definitions, definition);
    Impulses::gather(impulses, impulse);
    const EightInts contacts =
        each([this](const MechanismLink& l) { return world.contacts.has(l.mechanism) ? -1 : 0; });
    solver.begin_generic(i, definition, body, parent, anchor, parent_anchor, pull, impulse, contacts);
  }
};

void LaneBatch::prepare() const {
  const Work work(*this);
  const LaneSolver solver = work.solver(*this, 1);
  const std::size_t count = batch_.numbers.size();
  Start start{world_, solver, {}};
  for (std::uint32_t i = 0; i < work.links; ++i) {
    for (std::uint32_t lane = 0; lane < 8; ++lane)
      start.lanes[lane] = &world_.links[mechanism(lane < count ? lane : 0).first + i];
    const EightInts slots = work.memory.slots[i] = start.each([](const MechanismLink& l) { return l.body; });
    const MechanismLink& link = *start.lanes[0];
    const std::uint32_t number = work.first.first + i;
    const wide::LinkStart body = start.body(slots);
    start.begin_body(number, slots, body);
    if (link.joint == MechanismLink::none) continue;
    const EightInts parents = link.parent != MechanismLink::none
                                  ? work.memory.slots[link.parent - work.first.first]
                                  : start.each([](const MechanismLink& l) { return l.obstacle; });
    start.begin_joint(number, link, body, start.body(parents));
  }
}

void LaneBatch::store() const {
  const Work work(*this);
  const std::size_t count = batch_.numbers.size();
  const auto scatter = [&]<class Lanes>(Lanes, std::uint32_t i, const auto& from, auto* by_joint) {
    std::array<std::remove_pointer_t<decltype(by_joint)>*, 8> to{};
    for (std::uint32_t lane = 0; lane < count; ++lane)
      to[lane] = &by_joint[world_.links[mechanism(lane).first + i].joint];
    Lanes::scatter(from, to, count);
  };
  for (std::uint32_t i = 0, joint = 0; i < work.links; ++i) {
    const MechanismLink& link = world_.links[work.first.first + i];
    if (link.generic != MechanismLink::none) {
      scatter(Impulses{}, i, work.memory.generic[joint++].impulse(), world_.constrained.generic_impulses);
    } else if (link.joint != MechanismLink::none) {
      const auto& row = work.memory.states[i].row;
      const float sign = link.is_b ? 1.0f : -1.0f;
      scatter(BallImpulses{}, i, wide::BallImpulse{sign * row.impulse, sign * row.total},
              world_.constrained.joint_impulses);
    }
  }
}

template <class Act>
void LaneBatch::each_lane(LaneBits lanes, const Act& act) const {
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::uint32_t>(lowest_bit(lanes));
    const Mechanism& m = mechanism(lane);
    act(lane, &world_.states[m.first], &world_.generic[first_generic(m, world_.links)]);
  }
}

void LaneBatch::take_out(LaneBits lanes) const {
  const Work work(*this);
  each_lane(lanes, [&](std::uint32_t lane, LinkState* states, JointLink* generic) {
    for (std::uint32_t i = 0; i < work.links; ++i) States::take_out(work.memory.states[i], lane, states[i]);
    for (std::uint32_t i = 0; i < work.generic; ++i) Joints::take_out(work.memory.generic[i], lane, generic[i]);
  });
}

void LaneBatch::bring_back(LaneBits lanes) const {
  const Work work(*this);
  each_lane(lanes, [&](std::uint32_t lane, const LinkState* states, const JointLink* generic) {
    for (std::uint32_t i = 0; i < work.links; ++i) States::bring_back(states[i], lane, work.memory.states[i]);
    for (std::uint32_t i = 0; i < work.generic; ++i) Joints::bring_back(generic[i], lane, work.memory.generic[i]);
  });
}

LaneBits LaneBatch::loaded() const {
  LaneBits lanes = 0;
  for (std::uint32_t lane = 0; lane < batch_.numbers.size(); ++lane)
    if (world_.contacts.has(batch_.numbers[lane])) lanes |= 1u << lane;
  return lanes;
}

EightInts mask_of(LaneBits lanes) {
  EightInts mask{};
  for (; lanes != 0; lanes &= lanes - 1) mask[lowest_bit(lanes)] = -1;
  return mask;
}

/// Like MechanismSolver's; the others of the batch's lanes get nothing.
template <bool soft>
void LaneBatch::sweep_contacts(const Work& work, LaneBits lanes, float h) const {
  constexpr ContactPass pass = soft ? ContactPass::soft : ContactPass::relax;
  LinkContacts& contacts = world_.contacts;
  const LaneSolver solver = work.solver(*this, h);
  const auto number = [&](std::uint32_t lane, std::uint32_t i) {
    return mechanism(lane).first + (i - work.first.first);
  };
  const auto each_of = [lanes](const auto& act) {
    for (LaneBits left = lanes; left != 0; left &= left - 1) act(static_cast<std::uint32_t>(lowest_bit(left)));
  };
  const auto leads = [&](std::uint32_t i) {
    bool does = false;
    each_of([&](std::uint32_t lane) { does = does || contacts.leads(number(lane, i)); });
    return does;
  };
  const EightInts counts = mask_of(lanes);
  const auto response = [&](std::uint32_t i, std::uint32_t lane) {
    LinkPushes pushes;
    Pushes::take_out(solver.access.pushes(i), lane, pushes);
    return link_response(pushes);
  };
  const auto sweep_link = [&](std::uint32_t i) {
    const wide::LinkState& s = solver.state(i);
    const auto body = solver.access.body(i, world_.links[i]);
    const wide::Vec3 linear = s.motion.linear + s.step.linear;
    const wide::Vec3 angular = turned_back_by(s.spin, s.motion.angular + s.step.angular);
    wide::Vec3 force, torque;
    const auto of = [](const wide::Vec3& v, std::uint32_t lane) { return Vec3{v.x[lane], v.y[lane], v.z[lane]}; };
    const auto put = [](Vec3 from, std::uint32_t lane, wide::Vec3& v) {
      v.x[lane] = from.x, v.y[lane] = from.y, v.z[lane] = from.z;
    };
    bool any = false;
    each_of([&](std::uint32_t lane) {
      if (!contacts.has_link(number(lane, i))) return;
      ContactBody<LinkResponse> link{of(linear, lane),  of(angular, lane),    1,
                                     response(i, lane), of(body.moved, lane), of(body.turned, lane)};
      const Wrench sum = contacts.sweep<pass>(number(lane, i), link);
      put(sum.force, lane, force), put(sum.torque, lane, torque);
      any = true;
    });
    if (any) solver.push_by_contacts(i, force, torque);
  };
  solver.each([&](std::uint32_t i) {
    if (!leads(i)) return;
    solver.find_response(i);
    each_of([&](std::uint32_t lane) {
      if (contacts.has_link(number(lane, i))) contacts.begin(number(lane, i), response(i, lane));
    });
  });
  for (int round = 0; round < link_contact_rounds; ++round) {
    solver.sweep_along_tree(work.first.first, work.first.end, leads, sweep_link);
    solver.substitute<wide::LinkPass::closing>(counts);
  }
}

void LaneBatch::store_impulses(LaneBits lanes, bool ends_substep) const {
  for (; lanes != 0; lanes &= lanes - 1) world_.contacts.store_impulses(contacts_of(lanes), ends_substep);
}

void LaneBatch::take_back_contacts(LaneBits lanes) const {
  for (; lanes != 0; lanes &= lanes - 1) world_.contacts.take_back(contacts_of(lanes));
}

LinkContactRange LaneBatch::contacts_of(LaneBits lanes) const {
  return world_.contacts.of_mechanism(batch_.numbers[static_cast<std::size_t>(lowest_bit(lanes))]);
}

LaneBits LaneBatch::warm_start(float h) const {
  const Work work(*this);
  LaneSolver solver = work.solver(*this, h);
  const LaneBits slow = bits(solver.all([&](std::uint32_t i) { return solver.is_carried_slowly(i, solver.h); }));
  solver.access.counts = slow & work.in_use;
  solver.each([&](std::uint32_t i) { solver.give_carried(i, 1); });
  take_out(work.in_use & ~slow);
  return work.in_use & ~slow;
}

LanesAlone LaneBatch::pull_together(float h) const {
  const Work work(*this);
  LaneSolver solver = work.solver(*this, h);
  for (std::uint32_t i = 0; i < work.generic; ++i) work.memory.limits[i] = work.memory.generic[i].limits();
  solver.turn_all(false);
  const Eight masses = work.masses(*this);
  const EightInts solves_contacts = mask_of(loaded());
  solver.each([&](std::uint32_t i) { solver.set_closing(i, masses, solves_contacts); });
  const Mask slow = solver.all([&](std::uint32_t i) { return solver.turns_slowly(i, solver.h); });
  Mask good = solver.solve_with_limits(slow);
  const LaneBits looked_ahead = bits(good) & work.in_use;
  good = good & solver.all([&](std::uint32_t i) { return solver.does_meet(i, solver.h); });
  const LaneBits apart = looked_ahead & ~bits(good);
  take_out(apart);
  const LaneBits with_contacts = loaded() & bits(good);
  if (with_contacts != 0) sweep_contacts<true>(work, with_contacts, h);
  good = good & ~solver.overdrive(mask_of(with_contacts), true);
  good = good & solver.all([&](std::uint32_t i) { return solver.is_sound(i, solver.h); });
  const LaneBits done = bits(good) & work.in_use, others = work.in_use & ~done & ~apart;
  const auto exchange_limits = [&] {
    for (std::uint32_t i = 0; i < work.generic; ++i) std::swap(work.memory.limits[i], work.memory.generic[i].limits());
  };
  if (others != 0) {
    exchange_limits();
    take_out(others);
    exchange_limits();
  }
  solver.access.counts = done;
  const EightInts has_contacts = mask_of(with_contacts);
  solver.each([&](std::uint32_t i) { solver.note_pressed(i, solver.h, has_contacts); });
  solver.each([&](std::uint32_t i) { solver.apply<true>(i, solver.h, true); });
  store_impulses(with_contacts & done, false);
  take_back_contacts(with_contacts & ~done);
  return {others, apart};
}

LaneBits LaneBatch::relax(float h) const {
  const Work work(*this);
  LaneSolver solver = work.solver(*this, h);
  solver.each([&](std::uint32_t i) { solver.move_obstacle(i, solver.h); });
  for (const std::uint32_t number : batch_.numbers) world_.contacts.move_obstacles(number, h);
  solver.turn_all(true);
  for (;;) {
    solver.eliminate_all();
    solver.each([&](std::uint32_t i) { solver.aim_at_rest(i, 0, solver.h); });
    solver.substitute(wide::all_set);
    if (!wide::anywhere(solver.restrain_all())) break;
    solver.take_back();
  }
  const LaneBits with_contacts = loaded();
  if (with_contacts != 0) sweep_contacts<false>(work, with_contacts, h);
  const Mask restrained = ~solver.overdrive(mask_of(with_contacts), true);
  const LaneBits done =
      bits(restrained & solver.all([&](std::uint32_t i) { return solver.is_sound(i, solver.h); })) & work.in_use;
  take_out(work.in_use & ~done);
  solver.access.counts = done;
  solver.each([&](std::uint32_t i) { solver.apply<false>(i, solver.h, true); });
  store_impulses(with_contacts & done, true);
  take_back_contacts(with_contacts & ~done);
  return work.in_use & ~done;
}

template <auto member>
constexpr auto call = [](const MechanismWorld& world, const MechanismBatch& batch, auto... arguments) HWY_ATTR {
  return (LaneBatch(world, batch).*member)(arguments...);
};

}  // namespace

constexpr std::size_t link_bytes = sizeof(wide::LinkState) + sizeof(wide::LinkPushes) + sizeof(EightInts);
constexpr std::size_t joint_bytes = sizeof(wide::JointLink) + sizeof(wide::LinkLimits) + sizeof(wide::JointVector);

constexpr LaneFunctions lane_functions = {
    call<&LaneBatch::take_out>,   call<&LaneBatch::bring_back>,    call<&LaneBatch::prepare>, call<&LaneBatch::store>,
    call<&LaneBatch::warm_start>, call<&LaneBatch::pull_together>, call<&LaneBatch::relax>};

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace fathom::native {

std::size_t batch_bytes(std::uint32_t links, std::uint32_t generic) {
  return links * HWY_STATIC_DISPATCH(link_bytes) + generic * HWY_STATIC_DISPATCH(joint_bytes);
}

const LaneFunctions& lane_functions() {
#if HWY_TARGETS & HWY_AVX3
  if (std::strcmp(wide_kernels().name, hwy::TargetName(HWY_AVX3)) == 0) return N_AVX3::lane_functions;
#endif
  return HWY_STATIC_DISPATCH(lane_functions);
}

}  // namespace fathom::native
#endif
