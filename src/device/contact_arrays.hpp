// Contacts on the device: pairs of bodies whose fat boxes overlap, the manifolds of those that touch, and the counters
// that kernels share.
//
// Slots are taken with atomics, in any order, so nothing may depend on a contact's index in these arrays: colours
// follow from the pair's priority, sweeps from colours, and lists for the application are sorted when they are read.
//
// Manifolds, constraints and events have a capacity of their own: only a quarter of the pairs with overlapping fat
// boxes touch, and a touching one needs some 500 bytes, ten times as much as a pair.
#pragma once

#include <cstdint>

#include "check/check.hpp"
#include "device/body_arrays.hpp"
#include "device/tuning.hpp"
#include "dynamics/rolling.hpp"
#include "dynamics/touch.hpp"
#include "exec/atomic.hpp"

namespace fathom::device {

inline constexpr std::uint32_t dynamic_colours = 56;  ///< then colours of contacts with non-dynamic bodies
inline constexpr std::uint32_t further_colour = 64;   ///< then colours of contacts that found no lower one free
inline constexpr std::uint32_t colour_count = 128;
inline constexpr std::uint32_t overflow_colour = 128;
inline constexpr std::uint32_t schedule_size = colour_count + 1;

/// `Contact::bits`; the low byte is the colour.
enum ContactBits : std::uint32_t {
  colour_bits = 0xff,
  touching_bit = 0x100,
  fixed_a_bit = 0x200,  ///< A is static or kinematic
  fresh_bit = 0x400,    ///< found in this step
  round_bit = 0x800,    ///< a body is a sphere or a capsule; set once the contact has touched
  /// The manifold was made at the poses of impact (dynamics/look_ahead.hpp); `step_impulse` holds the time of impact
  /// until the step has an impulse.
  ahead_bit = 0x1000,
  in_touch_bit = 0x2000,  ///< the bodies touch, as reported by events (dynamics/touch.hpp)
  hits_bit = 0x4000,      ///< the last step's hit continues
  near_bit = 0x8000,      ///< near enough to touch as this step began
  closing_bit = 0x10000,  ///< approached faster than the hit threshold then
  touch_halvings_shift = 20,
  apart_bit = 0x20000,              ///< a joint keeps the bodies from touching
  on_moving_surface_bit = 0x40000,  ///< a body has a moving surface; set once the contact has touched
  in_parts_bit = 0x80000,           ///< a body is a compound: `children` counts (pieces.hpp)
  // Bits 20 to 23 are those of `touch_halvings_shift`.
  with_surface_bit = 0x1000000,  ///< A is a surface: the pair's patches have contacts of their own (surfaces.hpp)
  patch_bit = 0x2000000,         ///< one of those contacts
  by_direction_bit = 0x4000000,  ///< its friction depends on direction; set once the contact has touched
  // What the application has answered (ask.hpp).
  refused_bit = 0x8000000,      ///< the contact has been refused in this step
  own_slide_bit = 0x10000000,   ///< its surface slide is in `Contacts::own_slides`
  unanswered_bit = 0x20000000,  ///< it begins if the answer allows it
  kept_out_bit = 0x40000000,    ///< the pair never collides
};

struct alignas(16) Contact {
  std::uint32_t a = none, b = none;  ///< device indices; a non-dynamic body is always A; `none`: unused
  AxisCache axis;
  std::uint32_t bits = overflow_colour;
  float recycle_distance = 0;  ///< m
  /// Index of the manifold, if touching; for a pair with a surface, of its first patch.
  std::uint32_t manifold = none;
  /// Penetration (m) that counts as touching (dynamics/overlap.hpp); below 0, the contact counts as deeper than it is
  /// (dynamics/lift.hpp).
  float offset = 0;
  /// Which children of two compounds touch: A's in the upper half, B's in the lower. A patch has in the upper half the
  /// number of its surface's material, over its own number.
  std::uint32_t children = 0;

  FATHOM_HD bool is_with_surface() const { return bits & with_surface_bit; }
  FATHOM_HD bool is_patch() const { return bits & patch_bit; }
  /// For a patch, index of the pair's next one, or `none`; it needs no recycle distance of its own.
  FATHOM_HD std::uint32_t next_patch() const { return __builtin_bit_cast(std::uint32_t, recycle_distance); }
  FATHOM_HD void set_next_patch(std::uint32_t index) { recycle_distance = __builtin_bit_cast(float, index); }
  FATHOM_HD bool in_parts() const { return bits & in_parts_bit; }
  FATHOM_HD std::uint32_t child_a() const { return is_patch() ? 0 : children >> 16; }
  FATHOM_HD std::uint32_t patch_number() const { return children >> 16 & 0xffu; }
  FATHOM_HD std::uint32_t patch_material() const { return children >> 24; }
  FATHOM_HD void set_patch_material(std::uint32_t material) { children = (children & 0xffffffu) | material << 24; }
  FATHOM_HD std::uint32_t child_b() const { return children & 0xffffu; }

  FATHOM_HD bool in_use() const { return a != none; }
  /// There is a manifold: the bodies touch or may do so soon.
  FATHOM_HD bool touching() const { return bits & touching_bit; }
  FATHOM_HD bool in_touch() const { return bits & in_touch_bit; }
  FATHOM_HD std::uint32_t touch_halvings() const { return bits >> touch_halvings_shift & 15; }
  FATHOM_HD bool round() const { return bits & round_bit; }
  FATHOM_HD bool fixed_a() const { return bits & fixed_a_bit; }
  FATHOM_HD bool ahead() const { return bits & ahead_bit; }
  FATHOM_HD bool apart() const { return bits & apart_bit; }
  FATHOM_HD bool on_moving_surface() const { return bits & on_moving_surface_bit; }
  FATHOM_HD bool by_direction() const { return bits & by_direction_bit; }
  FATHOM_HD bool refused() const { return bits & refused_bit; }
  FATHOM_HD bool kept_out() const { return bits & kept_out_bit; }
  FATHOM_HD std::uint32_t colour() const { return bits & colour_bits; }
  FATHOM_HD void set_colour(std::uint32_t colour) { bits = (bits & ~colour_bits) | colour; }
};
static_assert(sizeof(Contact) == 32);

/// Pairs of shapes that are collided separately, so that neighbouring work-items do the same work: two boxes; a hull
/// and any convex shape; all other convex shapes; a surface and anything.
enum ShapePair : std::uint32_t { boxes, hulls, others, surfaces };
inline constexpr std::uint32_t shape_pairs = 4;

FATHOM_HD ShapePair shape_pair(ShapeType a, ShapeType b) {
  if (a == ShapeType::hull || b == ShapeType::hull) return hulls;
  return a == ShapeType::box && b == ShapeType::box ? boxes : others;
}

/// Contacts that a pair with a surface has beside its own, one for each patch in which the two may touch.
inline constexpr std::uint32_t patches_per_pair = 8;

/// Why a step stopped.
enum Stop : std::uint32_t {
  no_stop,
  no_room_for_pairs,      ///< nothing has changed: the step is repeated
  no_room_for_manifolds,  ///< for contacts that begin: the step resumes with the deferred ones
  body_failed,            ///< its state is not finite: the step is solved again without it
};

struct alignas(8) PairRecord {
  std::uint32_t a, b;
};
/// In a record of a touch, with `a`: the bodies may touch in other parts, too.
inline constexpr std::uint32_t part_tag = 1u << 31;

/// A hit as the device reports it, with device indices.
struct HitRecord {
  std::uint32_t a, b;
  Vec3 point, normal;
  float speed;
};

/// The range of a colour's constraints, or of the overflow's.
struct Stretch {
  std::uint32_t first, count;
};

/// Bounce sweeps whose results are recorded: those of the first four substeps.
inline constexpr std::uint32_t noted_bounce_sweeps = 4 * max_bounce_sweeps;

/// A new pair about which the application is asked.
struct FilterQuestion {
  std::uint32_t contact, a, b, unused;
};
/// A contact about which the application is asked before it is solved.
struct ContactQuestion {
  struct Point {
    Vec3 position;     ///< m, world axes
    float separation;  ///< m
    float impulse;     ///< N·s
  };
  std::uint32_t contact, a, b, child_a, child_b, point_count;
  Vec3 normal;  ///< world axes, from A to B
  Point points[max_manifold_points];
};
struct ContactAnswer {
  std::uint32_t contact;
  std::uint32_t enabled, has_own_slide;
  float friction, restitution;
  Vec3 slide;  ///< m/s, world axes
};

/// Two bodies in either order.
FATHOM_HD std::uint64_t refused_key(std::uint32_t a, std::uint32_t b) {
  return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
}

/// Counts that live on the device from one step to the next.
struct Counters {
  std::uint32_t bodies = 0;    ///< indices in use, holes included
  std::uint32_t contacts = 0;  ///< slots in use, holes included
  std::uint32_t free_contacts = 0;
  std::uint32_t patches = 0;       ///< slots of patches, among those in use
  std::uint32_t layout_dirty = 1;  ///< colours changed since the constraints were last laid out
  std::uint32_t may_bounce = 0;    ///< some contact has had a restitution above zero
  std::uint32_t step = 0;          ///< steps done, modulo 2³²
  std::uint32_t stopped = 0;       ///< a `Stop`; nothing runs until the host has handled it
  std::uint32_t manifolds = 0;     ///< slots in use, holes included
  std::uint32_t free_manifolds = 0;
  std::uint32_t changed = 0;     ///< 1: some body has a new fat box
  std::uint32_t wake_asked = 0;  ///< 1: the application woke a body
  std::uint32_t joints = 0;      ///< slots in use, holes included
  std::uint32_t mechanisms = 0, mechanism_links = 0;
  Vec3 gravity;  ///< m/s²

  // Of the current step.
  std::uint32_t live_bodies = 0;  ///< `bodies`, or 0 if the step was stopped
  std::uint32_t live_contacts = 0;
  std::uint32_t contact_groups = 0;
  std::uint32_t found = 0;                ///< pairs found by the search
  std::uint32_t found_with_surfaces = 0;  ///< of them
  std::uint32_t patch_slots_taken = 0;    ///< by those
  std::uint32_t added = 0;                ///< `found`, or 0 if the step was stopped
  std::uint32_t first_new = 0;            ///< the first slot after all used ones
  std::uint32_t recycling = 0;            ///< free slots before this step's pairs took theirs
  std::uint32_t levels = 1;               ///< grid levels with bodies, a bit each
  std::uint32_t changed_levels = 0;
  std::uint32_t search_groups = 0;
  std::uint32_t coarse_groups = 0;
  std::uint32_t grid_cells = 0;
  std::uint32_t grid_bodies = 0;
  std::uint32_t big = 0;
  std::uint32_t filled_entries = 0;  ///< table size of the grid when last filled; a table of another size is empty
  std::uint32_t to_collide[shape_pairs] = {};
  std::uint32_t fast[2] = {};          ///< fast pairs: without a hull, with one
  std::uint32_t looked_ahead[2] = {};  ///< of them, before the step stopped for lack of manifolds
  std::uint32_t fast_bodies = 0;       ///< entries of `Bodies::fast`
  std::uint32_t taken_manifolds = 0;
  std::uint32_t freed_manifolds = 0;
  std::uint32_t deferred[shape_pairs] = {};  ///< of `to_collide`: they touch, but there was no room for a manifold
  std::uint32_t uncoloured[colouring_rounds + 1] = {};
  std::uint32_t asked = 0;      ///< questions to the application
  std::uint32_t refused = 0;    ///< entries of `Contacts::refused`
  std::uint32_t any_began = 0;  ///< 1: some contact got a manifold; `begun` counts touches, which come later
  std::uint32_t any_ended = 0;  ///< 1: some contact lost its manifold
  std::uint32_t waking = 0;     ///< bodies to check for waking: 0 or all
  std::uint32_t layout_groups = 0;
  std::uint32_t laying_out = 0;                     ///< 1: constraints are laid out again
  std::uint32_t bounced[noted_bounce_sweeps] = {};  ///< per bounce sweep: whether anything bounced
  std::uint32_t per_colour[schedule_size] = {};     ///< zero except between CountColours and ScheduleColours
  std::uint32_t cursor[schedule_size] = {};
  Stretch schedule[schedule_size] = {};
  std::uint32_t sweeps = 0;                             ///< entries of `schedule`
  std::uint32_t former_sweeps = 0;                      ///< of the previous layout
  std::uint32_t first_dynamic = 0, dynamic_sweeps = 0;  ///< sweeps of contacts between dynamic bodies
  std::uint32_t any_further = 0;                        ///< 1: some contact has had a colour from `further_colour` on
  std::uint32_t further_sweeps = 0;                     ///< of those colours
  std::uint32_t any_isolated = 0;     ///< some body has been isolated because its state was not finite
  std::uint32_t recolouring = 0;      ///< 1: all contacts choose new colours in this step
  std::uint32_t recolour_trials = 0;  ///< how often that is still tried

  // Supports.
  std::uint32_t overloaded_step = none;  ///< the last step with overloaded contacts
  std::uint32_t loaded_step = 0;         ///< after this step no body has more than its own inertia
  std::uint32_t joined_step = none;      ///< the last step in which structures were found
  std::uint32_t unlevelled_step = none;  ///< the last step with one on a body without a level
  std::uint32_t held_step = none;        ///< the last step that held a body
  std::uint32_t solved_step = none;      ///< the last step that solved supports, even without effect
  std::uint32_t support_levels = 0;      ///< up to that of the highest body held in this step
  std::uint32_t top_level = 0;           ///< the first level without bodies, once known
  std::uint32_t support_rounds = 0;      ///< rounds that changed which bodies are held
  std::uint32_t supported = 0;           ///< bodies in `by_level`
  std::uint32_t has_wide_level = 0;      ///< 1: some level has more bodies than a warp has items
  std::uint32_t contacts_listed = 0;     ///< entries of `contacts_of`
  Stretch level[level_slots] = {};       ///< range of each level's bodies
  std::uint32_t level_cursor[level_slots] = {};

  std::uint32_t direct = 0;          ///< mechanisms solved directly
  std::uint32_t pushed_step = none;  ///< the last step in which some mechanism was to push a free body

  std::uint32_t first_overflow = 0;
  std::uint32_t overflow = 0;
  std::uint32_t constraints = 0;
  std::uint32_t solved_joints = 0;  ///< of them
  std::uint32_t constraint_groups = 0;
  std::uint32_t any_kinematic = 0;  ///< 1: some non-dynamic body moves
  std::uint32_t overrun = 0;        ///< 1: the solver needed more phases or items than were launched

  // For the report.
  std::uint32_t active = 0;  ///< awake bodies; counted only if bodies may sleep
  std::uint32_t recycled = 0, points = 0, begun = 0, ended = 0, hits = 0, quarantined = 0, islands = 0;

  std::uint32_t lacking_manifolds = 0;  ///< of the deferred pairs with surfaces, and of fast pairs

  /// Manifolds for which there was no room.
  FATHOM_HD std::uint32_t needed_manifolds() const {
    return deferred[boxes] + deferred[hulls] + deferred[others] + lacking_manifolds;
  }
};

/// The report of a step to the host, in pinned memory.
struct Report {
  std::uint32_t step = 0;
  std::uint32_t stopped = 0;
  std::uint32_t contacts = 0, free_contacts = 0, found = 0;  ///< `found`: slots for the pairs found
  std::uint32_t patches = 0;
  std::uint32_t manifolds = 0;  ///< in use; in a stopped step, those needed
  std::uint32_t constraints = 0, solved_joints = 0, colours = 0, overflow = 0;
  std::uint32_t recycled = 0, points = 0, begun = 0, ended = 0, hits = 0, quarantined = 0, islands = 0, active = 0;
  std::uint32_t overrun = 0;
};

/// A pair that moves fast for its size, or may touch at a seam. A contact is listed at most once in a step. Those of
/// one dynamic body are chained.
struct FastPair {
  static constexpr std::uint32_t lacks_manifold = none - 1;

  std::uint32_t contact;
  std::uint32_t next;  ///< next pair of B, `none`, or `lacks_manifold`: to be looked at again when the step resumes
};

/// A contact with a static or kinematic body. Those of one dynamic body are chained (seams.hpp).
struct alignas(8) FixedContact {
  std::uint32_t a;     ///< that body's piece
  std::uint32_t next;  ///< the next contact, or `none`
};

/// Parts of the contact data on the device, for `Contacts`.
enum ContactPart : std::uint8_t { contact_list, contact_worklists, contact_manifolds, contact_events };

/// Contacts, of which the parts `written` may be written (access.hpp).
template <ContactPart... written>
struct Contacts {
  template <class T, ContactPart part>
  using Of = Array<T, part, written...>;

  // `capacity` of each.
  Of<Contact, contact_list> contacts;
  Of<std::uint32_t, contact_list> free;
  Of<PairRecord, contact_worklists> found;          ///< pairs found by the search
  Of<std::uint32_t, contact_worklists> to_collide;  ///< lists of contacts, see `listed`
  Of<std::uint32_t, contact_worklists> deferred;    ///< likewise, in the memory of `found`
  Of<FastPair, contact_worklists> fast;             ///< two lists, see `fast_at`
  Of<std::uint32_t, contact_worklists> next_of_a;   ///< per entry of `fast` the next pair of A, or `none`; for bullets
  /// Pairs of bodies that the application has refused altogether, ascending, see `refused_key`.
  Of<std::uint64_t, contact_list> refused;
  Of<Vec3, contact_list> own_slides;  ///< m/s, world axes, by contact; null: the application is asked about none
  Of<FixedContact, contact_worklists> fixed_contacts;  ///< by contact; null: there are no seams
  std::uint32_t capacity;

  FATHOM_HD std::uint32_t fast_at(bool has_hull, std::uint32_t k) const {
    FATHOM_ASSERT(k < capacity, k);
    return has_hull ? capacity - 1 - k : k;
  }
  /// Index of the k-th contact of a list. Two lists share a range of `capacity` entries, from its two ends.
  FATHOM_HD std::uint32_t listed(ShapePair pairs, std::uint32_t k) const {
    if (pairs == boxes || pairs == hulls) return pairs == boxes ? k : capacity + k;
    return (pairs == others ? capacity : 2 * capacity) - 1 - k;
  }

  // `manifold_capacity` of each.
  Of<ContactManifold, contact_manifolds> manifolds;
  /// Slots without a contact. Those freed in a step follow the `free_manifolds` entries present at its beginning, until
  /// CountColours closes the gap left by those taken.
  Of<std::uint32_t, contact_manifolds> free_manifolds;
  Of<std::uint32_t, contact_worklists> uncoloured[2];
  // Events of the newest steps, as many as may be in flight, interleaved: a list keeps its address when it grows.
  Of<PairRecord, contact_events> begun;
  Of<PairRecord, contact_events> ended;
  Of<HitRecord, contact_events> hits;
  std::uint32_t event_lists;
  std::uint32_t manifold_capacity;

  /// Index of event k of step number `step`.
  FATHOM_HD std::size_t event(std::uint32_t step, std::uint32_t k) const {
    return static_cast<std::size_t>(k) * event_lists + step % event_lists;
  }
  /// Records that the bodies begin or cease to touch in this step.
  FATHOM_HD void note_touch(Contact& c, bool touches, Counters& counters) const {
    c.bits ^= in_touch_bit;
    const std::uint32_t k = exec::atomic_add(touches ? counters.begun : counters.ended, 1u);
    const PairRecord record{c.in_parts() || c.is_patch() ? c.a | part_tag : c.a, c.b};
    (touches ? begun : ended)[event(counters.step + 1, k)] = record;
  }

  template <ContactPart... fewer>
  FATHOM_HD operator Contacts<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(Contacts<fewer...>, *this);
  }
};

using ContactArrays = Contacts<contact_list, contact_worklists, contact_manifolds, contact_events>;

/// Bits of rare properties of constraints.
enum ConstraintExtras : std::uint32_t {
  offset_extra = 1,   ///< it counts as shallower or deeper than it is (`Contact::offset`)
  row_extra = 2,      ///< it has an entry in `ConstraintArrays::extras`
  direct_extra = 2,   ///< for a joint: it is solved directly, with its mechanism
  inertia_extra = 4,  ///< its `push_out_share` may be below one
  jointed_shift = 3,
  jointed_bits = jointed_steps << jointed_shift,  ///< `jointed_part` in steps
  all_extras = 7 | jointed_bits,
};

/// Additional rows of a contact with rolling resistance or a `ContactSurface`.
struct alignas(16) ContactExtras {
  RollRow roll;  ///< zero length without rolling resistance
  ContactSurface surface;
};

/// The bodies of a constraint, by device index, and its kind.
struct alignas(16) ConstraintHead {
  std::uint32_t a, b;
  std::uint32_t bits;
  /// Share of the last direct solution in both bodies, 0 if one of them was not held; its lowest bits hold
  /// `ConstraintExtras`.
  std::uint32_t held_and_extras;

  FATHOM_HD bool has(ConstraintExtras extra) const { return held_and_extras & extra; }
  FATHOM_HD float jointed() const {
    return static_cast<float>(held_and_extras >> jointed_shift & jointed_steps) * (1.0f / jointed_steps);
  }
  FATHOM_HD float held() const { return __builtin_bit_cast(float, held_and_extras & ~std::uint32_t{all_extras}); }
  FATHOM_HD void set_held(float part) {
    held_and_extras =
        (__builtin_bit_cast(std::uint32_t, part) & ~std::uint32_t{all_extras}) | (held_and_extras & all_extras);
  }
};

/// Rows of a constraint: frame, points, impulses, inverse masses and inertias of its bodies.
inline constexpr std::uint32_t friction_row = 5, first_point_row = 6, impulse_row = 10, mass_row = 12, row_count = 13;
/// Constraints per tile: as many as work-items load at once. Each row of a tile is contiguous in memory, and all rows
/// of a constraint are at fixed distances from the first.
inline constexpr std::uint32_t tile_width = 32;

/// A joint: four rows that sweeps read, then those that they write.
inline constexpr std::uint32_t joint_moment_row = impulse_row - 2, joint_impulse_row = impulse_row,
                               joint_total_row = impulse_row + 1;
/// A generic joint: five rows that sweeps read, then those that they write.
inline constexpr std::uint32_t generic_written_row = 5;

/// Parts of the constraint data on the device, for `Constraints`.
enum ConstraintPart : std::uint8_t { constraint_layout, constraint_heads, constraint_rows, constraint_supports };

/// Constraints in tiles, colour by colour, of which the parts `written` may be written (access.hpp).
template <ConstraintPart... written>
struct Constraints {
  template <class T, ConstraintPart part>
  using Of = Array<T, part, written...>;

  Of<PairRecord, constraint_layout> bodies;
  Of<ConstraintHead, constraint_heads> heads;
  Of<std::uint32_t, constraint_layout> contact;  ///< contact slot, or a joint's with `joint_tag`
  Of<std::uint32_t, constraint_layout> manifold;
  Of<Quad, constraint_rows> rows;
  Of<BounceRow, constraint_rows> bounces;
  Of<ContactExtras, constraint_rows> extras;
  Of<SupportRecord, constraint_supports> supports;
  Of<std::uint32_t, constraint_supports> contacts_of;  ///< constraints of each body, in order of colour
  std::uint32_t capacity;

  template <ConstraintPart... fewer>
  FATHOM_HD operator Constraints<fewer...>() const {
    static_assert((is_among<fewer, written...> && ...));
    return __builtin_bit_cast(Constraints<fewer...>, *this);
  }
};

using ConstraintArrays = Constraints<constraint_layout, constraint_heads, constraint_rows, constraint_supports>;

/// Factor of a body's inertia in this step.
template <BodyPart... written>
FATHOM_HD float inertia_scale(const Bodies<written...>& bodies, const Counters& counters, std::uint32_t i) {
  return exec::atomic_load(counters.loaded_step) >= counters.step ? bodies.support[i].load.inertia_scale : 1.0f;
}

}  // namespace fathom::device
