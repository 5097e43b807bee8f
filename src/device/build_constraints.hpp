// build_constraints: colours contacts that have no colour, lays out constraints colour by colour, and prepares the data
// that sweeps read.
//
// Colouring is greedy and persistent, as on the CPU: a contact takes the lowest colour free on both of its bodies when
// it begins to touch, and keeps it. No single thread visits new contacts in order; they choose in rounds: the contact
// with the highest priority on both bodies chooses (Jones and Plassmann, "A Parallel Graph Coloring Heuristic",
// 1993). Priorities are a hash of the pair, so the outcome depends only on the contacts. A body's colours are the bits
// of one word, and of a second one that is used only when the first is full. A contact that finds no free colour, or
// cannot choose within the rounds, is in this step's overflow, whose constraints share out the masses of their bodies
// (mass_splitting.hpp), and tries again in the next step: no contact is ever left out.
//
// Joints come with a colour (device/joint_arrays.hpp), which is also set in their bodies' words. In the layout a
// colour's joints follow its contacts.
#pragma once

#include "check/check.hpp"
#include "device/constraint_rows.hpp"
#include "device/contact_arrays.hpp"
#include "device/joint_arrays.hpp"
#include "device/pieces.hpp"
#include "device/tuning.hpp"
#include "dynamics/integrate.hpp"
#include "exec/atomic.hpp"
#include "exec/bits.hpp"
#include "exec/group.hpp"
#include "exec/kernel.hpp"

namespace fathom::device {

/// Unique for each pair of pieces, whose indices are below 2²⁸: a bijection of 56-bit words, so neighbours need not
/// choose one after the other.
FATHOM_HD std::uint64_t priority(std::uint32_t a, std::uint32_t b) {
  constexpr std::uint64_t mask = (std::uint64_t{1} << 56) - 1;
  std::uint64_t x = std::uint64_t{a} << 28 | b;
  x ^= x >> 29;
  x = x * 0x9e3779b97f4a7c15u & mask;
  x ^= x >> 27;
  x = x * 0xd6e8feb86659fd93u & mask;
  return x ^ x >> 28;
}

/// Whether contacts have been deferred; colouring then waits for them.
FATHOM_HD bool is_stopping(const Counters& c) { return c.needed_manifolds() > 0; }

/// A contact between dynamic bodies takes the lowest colour that is free on both, if any.
FATHOM_HD void choose_colour(Contact& c, std::uint64_t* colours, std::uint64_t* further, Counters& counters) {
  constexpr std::uint64_t fixed = ~std::uint64_t{0} << dynamic_colours;
  std::uint64_t taken = colours[c.a] | colours[c.b] | fixed;
  std::uint32_t first = 0;
  if (~taken == 0) {
    colours = further;
    taken = colours[c.a] | colours[c.b];
    if (~taken == 0) return;
    first = further_colour;
    exec::atomic_store(counters.any_further, 1u);
  }
  const std::uint32_t free = exec::lowest_bit(~taken);
  c.set_colour(first + free);
  colours[c.a] |= std::uint64_t{1} << free;
  colours[c.b] |= std::uint64_t{1} << free;
}

/// All contacts between dynamic bodies choose again, colour by colour from the last to the first. A colour's contacts
/// share no body, so they choose concurrently; the result never has more colours, and usually fewer ("iterated greedy":
/// Culberson and Luo, "Exploring the k-colorable landscape with iterated greedy", 1996). Each colour saved is nine
/// solver phases saved.
///
/// It works on the previous step's layout: contacts that have ended or begun since are not in their colour.
struct RecolourContacts {
  Bodies<body_colours> bodies;
  Contacts<contact_list> contacts;
  Constraints<> constraints;
  Counters* counters;

  static constexpr std::uint64_t fixed = ~std::uint64_t{0} << dynamic_colours;

  FATHOM_HD std::uint32_t phases() const { return counters->recolouring && !is_stopping(*counters) ? sweeps() + 2 : 0; }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const {
    return is_sweep(phase) ? stretch(phase).count : counters->live_bodies;
  }

  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t k) const {
    if (is_sweep(phase))
      choose(constraints.contact[stretch(phase).first + k],
             counters->any_isolated && phase <= counters->dynamic_sweeps);
    else if (phase == 0)
      begin(k);
    else
      end(k);
  }

 private:
  // Contacts of isolated bodies keep their colours, so these must be reserved before the others choose.
  FATHOM_HD std::uint32_t sweeps() const { return (counters->any_isolated ? 2 : 1) * counters->dynamic_sweeps; }
  FATHOM_HD bool is_sweep(std::uint32_t phase) const { return phase > 0 && phase <= sweeps(); }
  FATHOM_HD Stretch stretch(std::uint32_t phase) const {
    return counters
        ->schedule[counters->first_dynamic + counters->dynamic_sweeps - 1 - (phase - 1) % counters->dynamic_sweeps];
  }

  FATHOM_HD void begin(std::uint32_t i) const {
    const bool awake = bodies.is_awake(i);
    const std::uint64_t kept = counters->joints ? fixed | bodies.joint_colours[i] : fixed;
    bodies.recoloured[i] = awake ? bodies.colours[i] & kept : bodies.colours[i];
    if (counters->any_further) bodies.further_recoloured[i] = awake ? 0 : bodies.further[i];
  }
  FATHOM_HD void end(std::uint32_t i) const {
    bodies.colours[i] = bodies.recoloured[i];
    if (counters->any_further) bodies.further[i] = bodies.further_recoloured[i];
  }

  FATHOM_HD void choose(std::uint32_t index, bool keep) const {
    if (index & joint_tag) return;
    Contact& c = contacts.contacts[index];
    if (!c.in_use() || !c.touching() || c.fixed_a() || c.colour() == overflow_colour) return;
    const bool both_awake = bodies.flags[c.a] & bodies.flags[c.b] & awake_flag;
    if (keep == both_awake && counters->any_isolated) return;
    if (!keep) return choose_colour(c, bodies.recoloured, bodies.further_recoloured, *counters);
    std::uint64_t* const taken = c.colour() < further_colour ? bodies.recoloured : bodies.further_recoloured;
    const std::uint64_t bit = std::uint64_t{1} << c.colour() % further_colour;
    taken[c.a] |= bit;
    taken[c.b] |= bit;
  }
};

/// Rounds of two phases: uncoloured contacts post their priorities, then the highest ones choose.
struct ColourContacts {
  Bodies<body_colours> bodies;
  Contacts<contact_list, contact_worklists> contacts;
  Counters* counters;

  FATHOM_HD std::uint32_t phases() const { return is_stopping(*counters) ? 0 : 2 * colouring_rounds; }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const { return counters->uncoloured[phase / 2]; }

  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t k) const {
    const std::uint32_t round = phase / 2;
    const std::uint32_t index = contacts.uncoloured[round % 2][k];
    Contact& c = contacts.contacts[index];
    if (!c.touching()) return;
    const TouchingPieces pieces = ranked_pieces(bodies, c);
    // Later rounds have higher values, so earlier posts need no clearing.
    const std::uint64_t mine = std::uint64_t{round + 1} << 56 | priority(pieces.a, pieces.b);
    if (phase % 2 == 0) {
      exec::atomic_max(bodies.best[c.b], mine);
      if (!c.fixed_a()) exec::atomic_max(bodies.best[c.a], mine);
    } else if (bodies.best[c.b] == mine && (c.fixed_a() || bodies.best[c.a] == mine)) {
      choose(c);
    } else {
      contacts.uncoloured[1 - round % 2][exec::atomic_add(counters->uncoloured[round + 1], 1u)] = index;
    }
  }

 private:
  FATHOM_HD void choose(Contact& c) const {
    if (c.fixed_a()) {
      constexpr std::uint64_t dynamic = ~(~std::uint64_t{0} << dynamic_colours);
      const std::uint64_t taken = bodies.colours[c.b] | dynamic;
      if (~taken == 0) return;
      c.set_colour(exec::lowest_bit(~taken));
      bodies.colours[c.b] |= std::uint64_t{1} << c.colour();
    } else {
      choose_colour(c, bodies.colours, bodies.further, *counters);
    }
    if (c.colour() != overflow_colour) exec::atomic_store(counters->layout_dirty, 1u);
  }
};

/// Both, one after the other. Contacts of sleeping bodies have colours but are not in the layout, so nothing is
/// recoloured while bodies sleep.
struct ChooseColours {
  static constexpr bool ends_at_empty_phase = true;
  static constexpr bool has_few_items = true;
  static constexpr std::uint32_t group_size = 256;
  static constexpr std::uint32_t max_phases =
      2 * (dynamic_colours + colour_count - further_colour) + 2 + 2 * colouring_rounds;

  RecolourContacts recolour;
  ColourContacts colour;
  bool recolours;

  FATHOM_HD std::uint32_t phases() const { return recolouring_phases() + colour.phases(); }
  FATHOM_HD std::uint32_t items(std::uint32_t phase) const {
    const std::uint32_t first = recolouring_phases();
    return phase < first ? recolour.items(phase) : colour.items(phase - first);
  }
  FATHOM_HD void operator()(std::uint32_t phase, std::uint32_t k) const {
    const std::uint32_t first = recolouring_phases();
    if (phase < first)
      recolour(phase, k);
    else
      colour(phase - first, k);
  }

 private:
  FATHOM_HD std::uint32_t recolouring_phases() const { return recolours ? recolour.phases() : 0; }
};

/// Number of free manifold slots that were reused.
FATHOM_HD std::uint32_t reused_manifolds(const Counters& c) {
  return c.taken_manifolds < c.free_manifolds ? c.taken_manifolds : c.free_manifolds;
}

/// Contacts as input for the layout of constraints.
struct ContactsToLayOut {
  Bodies<> bodies;
  Contacts<contact_manifolds> contacts;

  FATHOM_HD static std::uint32_t count(const Counters& c) { return c.live_contacts; }
  /// Colour of constraint `index`, or `none` if it is not solved: only those that touch and have an awake body are.
  FATHOM_HD std::uint32_t colour(std::uint32_t index) const {
    const Contact& c = contacts.contacts[index];
    const bool solved = c.in_use() && c.touching() && (bodies.flags[c.a] | bodies.flags[c.b]) & awake_flag;
    return solved ? c.colour() : none;
  }
  FATHOM_HD void put(const Constraints<constraint_layout>& constraints, std::uint32_t entry,
                     std::uint32_t index) const {
    const Contact& c = contacts.contacts[index];
    FATHOM_ASSERT(c.manifold < contacts.manifold_capacity, c.b);
    FATHOM_VALIDATE(has_its_colour(c), c.b);
    constraints.contact[entry] = index;
    constraints.manifold[entry] = c.manifold;
    constraints.bodies[entry] = {c.a, c.b};
  }
  /// Moves the last freed manifolds into the gap in their list, which exists only if a contact began; then counts all
  /// contacts.
  FATHOM_HD void before_counting(std::uint32_t k, const Counters& c) const {
    const std::uint32_t free = c.free_manifolds, freed = c.freed_manifolds;
    const std::uint32_t gap = reused_manifolds(c);
    if (k >= (gap < freed ? gap : freed)) return;
    contacts.free_manifolds[free - gap + k] = contacts.free_manifolds[free + freed - 1 - k];
  }
  FATHOM_HD static void note_laid_out(Counters&, std::uint32_t) {}

 private:
  /// Whether its bodies have reserved its colour.
  FATHOM_HD bool has_its_colour(const Contact& c) const {
    if (c.colour() == overflow_colour) return true;
    const std::uint64_t* const taken = c.colour() < further_colour ? bodies.colours : bodies.further;
    const std::uint64_t bit = std::uint64_t{1} << c.colour() % further_colour;
    return taken[c.b] & bit && (c.fixed_a() || taken[c.a] & bit);
  }
};

/// The same for joints.
struct JointsToLayOut {
  Bodies<> bodies;
  Joints<> joints;

  FATHOM_HD static std::uint32_t count(const Counters& c) { return c.live_bodies ? c.joints : 0; }
  FATHOM_HD std::uint32_t colour(std::uint32_t slot) const {
    const JointRecord& joint = joints.records[slot];
    const bool solved = joint.in_use() && (bodies.flags[joint.a] | bodies.flags[joint.b]) & awake_flag;
    return solved ? joint.colour : none;
  }
  FATHOM_HD void put(const Constraints<constraint_layout>& constraints, std::uint32_t entry, std::uint32_t slot) const {
    const JointRecord& joint = joints.records[slot];
    constraints.contact[entry] = joint_tag | slot;
    constraints.manifold[entry] = 0;
    constraints.bodies[entry] = {joint.a, joint.b};
  }
  FATHOM_HD static void before_counting(std::uint32_t, const Counters&) {}
  FATHOM_HD static void note_laid_out(Counters& c, std::uint32_t n) { exec::atomic_add(c.solved_joints, n); }
};

/// Counts the constraints of each colour if they must be laid out again.
template <class List>
struct CountColours {
  static constexpr std::uint32_t group_size = 128;
  struct Local {
    std::uint32_t count[schedule_size];
  };

  List list;
  Counters* counters;

  FATHOM_HD void operator()(auto group, Local& local) const {
    if (!counters->layout_dirty || is_stopping(*counters)) return;
    group.for_each(schedule_size, [&](std::uint32_t k) { local.count[k] = 0; });
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t index = group.index() * group_size + item;
      if (index >= list.count(*counters)) return;
      list.before_counting(index, *counters);
      const std::uint32_t colour = list.colour(index);
      if (colour != none) exec::atomic_add(local.count[colour], 1u);
    });
    group.for_each(schedule_size, [&](std::uint32_t k) {
      if (local.count[k]) exec::atomic_add(counters->per_colour[k], local.count[k]);
    });
  }
};

/// Finds the start of each colour, and the order of sweeps: the overflow, further colours, the others, and last those
/// against fixed bodies, because the ground is the firmer side. Stops the step if contacts were deferred.
struct ScheduleColours {
  static constexpr std::uint32_t group_size = colour_count;
  struct Local {
    std::uint32_t constraints[colour_count];  ///< of an entry in that order and all before it
    std::uint32_t colours[colour_count];      ///< nonempty colours up to the entry
    std::uint32_t lays_out;
  };

  Counters* counters;

  FATHOM_HD void operator()(auto group, Local& local) const {
    group.once([&] { local.lays_out = begin(*counters); });
    if (!group.broadcast(local.lays_out)) return;
    group.for_each([&](std::uint32_t item) {
      local.constraints[item] = counters->per_colour[colour(item)];
      local.colours[item] = local.constraints[item] > 0;
    });
    auto constraints = per_item<std::uint32_t>(group);
    auto colours = per_item<std::uint32_t>(group);
    for (std::uint32_t step = 1; step < group_size; step *= 2) {
      group.for_each([&](std::uint32_t item) {
        constraints[item] = item < step ? 0 : local.constraints[item - step];
        colours[item] = item < step ? 0 : local.colours[item - step];
      });
      group.for_each([&](std::uint32_t item) {
        local.constraints[item] += constraints[item];
        local.colours[item] += colours[item];
      });
    }
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t count = counters->per_colour[colour(item)], first = local.constraints[item] - count;
      counters->per_colour[colour(item)] = 0;
      counters->cursor[colour(item)] = first;
      if (count) counters->schedule[counters->first_dynamic + local.colours[item] - 1] = {first, count};
    });
    group.once([&] { end(*counters, local); });
  }

 private:
  static constexpr std::uint32_t further = colour_count - further_colour;

  /// The colour at an index in that order.
  FATHOM_HD static std::uint32_t colour(std::uint32_t index) {
    return index < further ? further_colour + index : index - further;
  }

  /// Whether constraints must be laid out again.
  FATHOM_HD static bool begin(Counters& c) {
    c.direct = 0;  // set by CheckLinks and PrepareMechanisms
    c.any_kinematic = c.support_levels = c.contacts_listed = c.has_wide_level = c.layout_groups = c.laying_out = 0;
    for (std::uint32_t k = 0; c.may_bounce && k < noted_bounce_sweeps; ++k) c.bounced[k] = 0;
    if (is_stopping(c) && !c.stopped) {
      c.stopped = no_room_for_manifolds;
      c.taken_manifolds -= c.needed_manifolds();
      c.live_bodies = c.live_contacts = c.contact_groups = 0;
    }
    if (c.live_bodies == 0) {
      c.sweeps = c.constraints = c.constraint_groups = c.solved_joints = 0;
      c.layout_dirty = 1;
      return false;
    }
    if (!c.layout_dirty) return false;
    c.layout_dirty = 0;
    c.laying_out = 1;
    c.solved_joints = 0;
    c.layout_groups = c.contact_groups;
    const std::uint32_t reused = reused_manifolds(c);
    c.manifolds += c.taken_manifolds - reused;
    c.free_manifolds += c.freed_manifolds - reused;
    c.taken_manifolds = c.freed_manifolds = 0;
    c.overflow = c.per_colour[overflow_colour];
    c.per_colour[overflow_colour] = 0;
    c.first_dynamic = c.overflow ? 1 : 0;
    return true;
  }

  FATHOM_HD static void end(Counters& c, const Local& local) {
    const std::uint32_t begin = local.constraints[group_size - 1];
    c.sweeps = c.first_dynamic + local.colours[group_size - 1];
    c.further_sweeps = local.colours[further - 1];
    c.dynamic_sweeps = local.colours[further + dynamic_colours - 1];
    c.first_overflow = c.cursor[overflow_colour] = begin;
    if (c.overflow) c.schedule[0] = {begin, c.overflow};
    c.constraints = begin + c.overflow;
    c.constraint_groups = (c.constraints + constraint_group_size - 1) / constraint_group_size;
    // A colouring that is no better than the last is retried a few times, then kept until contacts change.
    if (c.any_began || c.sweeps < c.former_sweeps)
      c.recolour_trials = 4;
    else if (c.recolouring && c.recolour_trials)
      --c.recolour_trials;
    c.former_sweeps = c.sweeps;
  }
};

template <class List>
struct LayOutConstraints {
  static constexpr std::uint32_t group_size = 128;
  struct Local {
    std::uint32_t count[schedule_size];
    std::uint32_t first[schedule_size];
  };

  List list;
  Constraints<constraint_layout> constraints;
  Counters* counters;

  FATHOM_HD void operator()(auto group, Local& local) const {
    if (!counters->laying_out) return;
    auto colour = per_item<std::uint32_t>(group);
    auto rank = per_item<std::uint32_t>(group);
    group.for_each(schedule_size, [&](std::uint32_t k) { local.count[k] = 0; });
    group.for_each([&](std::uint32_t item) {
      const std::uint32_t index = group.index() * group_size + item;
      colour[item] = index < list.count(*counters) ? list.colour(index) : none;
      if (colour[item] != none) rank[item] = exec::atomic_add(local.count[colour[item]], 1u);
    });
    group.for_each(schedule_size, [&](std::uint32_t k) {
      if (local.count[k] == 0) return;
      local.first[k] = exec::atomic_add(counters->cursor[k], local.count[k]);
      list.note_laid_out(*counters, local.count[k]);
    });
    group.for_each([&](std::uint32_t item) {
      if (colour[item] == none) return;
      const std::uint32_t entry = local.first[colour[item]] + rank[item];
      FATHOM_ASSERT(entry < constraints.capacity, entry);
      list.put(constraints, entry, group.index() * group_size + item);
    });
  }
};

/// Loads bodies in contact for the solver.
struct LoadBodies {
  Bodies<body_colours, body_solver, body_supports> bodies;
  Counters* counters;
  float h, dt;  ///< s, a substep and a step

  FATHOM_HD void operator()(std::uint32_t i) const {
    bodies.best[i] = 0;
    if (counters->overflow > 0) bodies.split[i] = {};
    const BodyConstants c = bodies.constants[i];
    if (!c.is_living()) return;
    // Each of a body's contacts has its own colour, except those in the overflow (with cells: all awake ones), so
    // colours share no body.
    FATHOM_VALIDATE(counters->overflow > 0 || !bodies.is_awake(i) ||
                        exec::bit_count(bodies.colours[i]) + exec::bit_count(bodies.further[i]) == bodies.touching[i],
                    i);
    const bool solved = bodies.touching[i] > 0 || c.motion() != MotionType::dynamic;
    if (!solved) return;
    SolverBody body;
    if (!bodies.is_awake(i)) {
      bodies.solver[i] = SolverQuads(body);
      bodies.motion[i] = {};
      return;
    }
    if (c.motion() != MotionType::fixed && c.inverse_mass == 0) exec::atomic_store(counters->any_kinematic, 1u);
    const Velocity v = bodies.velocities[i];
    body.linear = v.linear;
    body.angular = v.angular;
    if (c.is_dynamic() && exec::atomic_load(counters->loaded_step) >= counters->step) give_back(i, body);
    const float inverse_scale = 1.0f / inertia_scale(bodies, *counters, i);
    body.inverse_mass = inverse_scale * c.inverse_mass;
    body.inverse_inertia = inverse_scale * c.inverse_inertia;
    bodies.solver[i] = SolverQuads(body);
    BodyMotion motion;
    if (c.is_dynamic()) {
      motion = motion_under(c.gravity_scale * counters->gravity, c.linear_damping, c.angular_damping, h);
      if (!(c.inverse_mass > 0)) motion.linear_damping = 0;
      const Quat q = bodies.poses[i].rotation;
      if (bodies.flags[i] & forced_flag) {
        const Acceleration a = forced_acceleration(bodies, i, q, motion.acceleration);
        motion.acceleration = a.linear;
        motion.angular_acceleration = inverse_scale * a.angular;
      }
      motion.acceleration *= inverse_scale;  // forces are unchanged
      if (!c.is_isotropic()) {
        const SymMat3 world = rotated(to_matrix(q), inverse_scale * bodies.tensors[i].inverse);
        bodies.inertia[i] = {world.xx, world.yy, world.zz, world.xy, world.xz, world.yz, 0, 0, q};
      }
    }
    bodies.motion[i] = motion;
  }

 private:
  /// Momentum that the body's added inertia has taken up.
  FATHOM_HD void give_back(std::uint32_t i, SolverBody& body) const {
    OwedMomentum& owed = bodies.support[i].owed;
    if (!owed.any()) return;
    const float scale = inertia_scale(bodies, *counters, i), fall = length(counters->gravity) * dt;
    const Velocity given = owed.give(scale, bodies.constants[i].radius, fall);
    body.linear += given.linear, body.angular += given.angular;
  }
};

}  // namespace fathom::device
