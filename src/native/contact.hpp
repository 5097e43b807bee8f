// A pair of bodies whose boxes overlap, and the manifold it has while they touch.
//
// Two structures. Many pairs never touch, and the narrow phase looks at every contact in every step: two of them share
// a cache line. Constraint building transposes manifolds into vector lanes, which is why these are made of 16-byte
// quads.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

#include "dynamics/contact_manifold.hpp"
#include "dynamics/tuning.hpp"

namespace fathom::native {

inline constexpr std::uint32_t none = 0xffffffffu;
inline constexpr std::uint8_t no_colour = 0xff;
inline constexpr int colour_count = 32;
inline constexpr int first_fixed_colour = 24;        ///< of contacts with a body that cannot be pushed
inline constexpr std::uint8_t overflow_colour = 32;  ///< of contacts that found no colour

/// What a constraint of the graph is.
enum class ConstraintKind : std::uint8_t { contact, ball_joint, generic_joint, coupling };
inline constexpr std::size_t constraint_kinds = 4;

/// A constraint as layouts and blocks name it: its index among those of its kind, and the kind in the highest bits.
using ConstraintRef = std::uint32_t;
inline constexpr int kind_shift = 28;
inline constexpr ConstraintRef constraint_ref(ConstraintKind kind, std::uint32_t index) {
  return static_cast<ConstraintRef>(kind) << kind_shift | index;
}
/// Of one that is not `none`.
inline constexpr ConstraintKind kind_of(ConstraintRef ref) { return static_cast<ConstraintKind>(ref >> kind_shift); }
inline constexpr std::uint32_t index_of(ConstraintRef ref) { return ref & ((1u << kind_shift) - 1); }

/// Which children of two compounds touch; 0 of bodies that are none.
struct Children {
  std::uint32_t a = 0, b = 0;
};

/// How far a contact's bodies may move before its manifold is rebuilt, or what its depth is taken to be less, or more.
/// One word for all three, because contacts are many, and few have an offset. A manifold is never kept with an overlap;
/// with a lift it is, and the distance is worked out where it is asked for.
class Slack {
 public:
  Slack() = default;
  static Slack of_distance(float distance) { return Slack(distance); }
  static Slack of_overlap(float overlap) { return Slack(-overlap); }
  static Slack of_lift(float lift) { return lift > lift_gone ? Slack(-lift_scale * lift) : Slack(0); }

  /// Whether the distance is known: no offset, and nothing that rolls.
  bool recycles() const { return value_ > 0; }
  bool is_lifted() const { return value_ <= -1; }
  /// m that the bodies may move against each other before the manifold is rebuilt, where it `recycles`; else 0.
  float recycle_distance() const { return max(value_, 0.0f); }
  /// m of depth that counts as touching (dynamics/overlap.hpp).
  float overlap() const { return is_lifted() ? 0.0f : max(-value_, 0.0f); }
  /// m that the contact counts as deeper than it is (dynamics/lift.hpp).
  float lift() const { return is_lifted() ? value_ / -lift_scale : 0.0f; }
  /// m that is added to separations.
  float offset() const { return overlap() - lift(); }

 private:
  static constexpr float lift_scale = 16777216;  // tells lifts from overlaps, and takes no digits from them
  static_assert(lift_scale * lift_gone > 1 && max_first_overlap < 1);

  explicit Slack(float value) : value_(value) {}
  float value_ = 0;  // the distance, the negative of an overlap, or a scaled one of a lift
};

struct alignas(32) Contact {
  std::uint32_t a = none, b = none;  ///< slots; a body that cannot be pushed is always A
  std::uint32_t manifold = none;     ///< while touching
  AxisCache axis;
  std::uint64_t born = 0;  ///< how many contacts were made before it
  Slack slack;
  std::uint8_t colour = no_colour;
  bool fixed_a = false;     ///< A is fixed or kinematic
  bool in_use : 1 = false;  ///< the slot holds a pair, or a part of one
  /// A is a surface or some body a compound: they may touch in several parts, each with a contact.
  bool in_parts : 1 = false;
  bool is_part : 1 = false;            ///< one of these after the first: looked at with that one
  bool on_moving_surface : 1 = false;  ///< a body's surface moves against it; known of those that have touched
  bool own_slide : 1 = false;          ///< the application has chosen how its surfaces move (`ContactGraph::give`)
  std::uint8_t unused_bits : 3 = 0;
  bool round : 1 = false;  ///< a body is a sphere or a capsule; known of those that have touched
  /// The manifold was made where the bodies will meet (dynamics/look_ahead.hpp), at a time that is in its
  /// `step_impulse` until the step has one.
  bool ahead : 1 = false;
  bool in_touch : 1 = false;            ///< the bodies touch, as events tell (dynamics/touch.hpp)
  bool hits : 1 = false;                ///< the last step's hit goes on
  std::uint8_t touch_halvings : 4 = 0;  ///< see `touch_distance`

  /// Of a pair, as the narrow phase looks at it.
  bool is_pair() const { return in_use && !is_part; }
  /// There is a manifold: the bodies touch or soon may.
  bool touching() const { return manifold != none; }
  /// `in_touch`, `hits` and `touch_halvings`, from the lowest bit.
  std::uint32_t touch_bits() const {
    return static_cast<std::uint32_t>(in_touch) | static_cast<std::uint32_t>(hits) << 1 |
           static_cast<std::uint32_t>(touch_halvings) << 2;
  }
};
static_assert(sizeof(Contact) == 32);

}  // namespace fathom::native
