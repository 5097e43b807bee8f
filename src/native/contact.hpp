// A pair of bodies whose boxes overlap, and its manifold while they touch.
//
// There are two structures. Many pairs never touch, and the narrow phase reads every contact in every step, so two
// contacts share a cache line. Building constraints transposes manifolds into vector lanes, so manifolds consist of
// 16-byte quads.
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

/// Kind of a constraint in the graph.
enum class ConstraintKind : std::uint8_t { contact, ball_joint, generic_joint, coupling };
inline constexpr std::size_t constraint_kinds = 4;

/// A constraint as layouts and blocks refer to it: its index among its kind, with the kind in the highest bits.
using ConstraintRef = std::uint32_t;
inline constexpr int kind_shift = 28;
inline constexpr ConstraintRef constraint_ref(ConstraintKind kind, std::uint32_t index) {
  return static_cast<ConstraintRef>(kind) << kind_shift | index;
}
/// For any reference but `none`.
inline constexpr ConstraintKind kind_of(ConstraintRef ref) { return static_cast<ConstraintKind>(ref >> kind_shift); }
inline constexpr std::uint32_t index_of(ConstraintRef ref) { return ref & ((1u << kind_shift) - 1); }

/// Which children of two compounds touch; of a surface, the number of the material that is touched. 0 for others.
struct Children {
  std::uint32_t a = 0, b = 0;
};

/// A contact's recycle distance (how far its bodies may move before its manifold is rebuilt), overlap or lift. One word
/// stores all three, because contacts are many and few have an offset. A manifold with an overlap is never recycled.
/// One with a lift is, and its recycle distance is computed when needed.
class Slack {
 public:
  Slack() = default;
  static Slack of_distance(float distance) { return Slack(distance); }
  static Slack of_overlap(float overlap) { return Slack(-overlap); }
  static Slack of_lift(float lift) { return lift > lift_gone ? Slack(-lift_scale * lift) : Slack(0); }

  /// Whether the distance is stored: the contact has no offset and nothing rolls.
  bool recycles() const { return value_ > 0; }
  bool is_lifted() const { return value_ <= -1; }
  /// Distance (m) that the bodies may move relative to each other before the manifold is rebuilt, if it `recycles`;
  /// else 0.
  float recycle_distance() const { return max(value_, 0.0f); }
  /// Depth (m) that counts as touching (dynamics/overlap.hpp).
  float overlap() const { return is_lifted() ? 0.0f : max(-value_, 0.0f); }
  /// Depth (m) by which the contact counts as deeper than it is (dynamics/lift.hpp).
  float lift() const { return is_lifted() ? value_ / -lift_scale : 0.0f; }
  /// Offset (m) added to separations.
  float offset() const { return overlap() - lift(); }

 private:
  static constexpr float lift_scale = 16777216;  // distinguishes lifts from overlaps without loss of digits
  static_assert(lift_scale * lift_gone > 1 && max_first_overlap < 1 && max_deep_overlap < 1);

  explicit Slack(float value) : value_(value) {}
  float value_ = 0;  // the distance, the negative overlap, or the negative scaled lift
};

struct alignas(32) Contact {
  std::uint32_t a = none, b = none;  ///< slots; a body that cannot be pushed is always A
  std::uint32_t manifold = none;     ///< while touching
  AxisCache axis;
  std::uint64_t born = 0;  ///< number of contacts made before it
  Slack slack;
  std::uint8_t colour = no_colour;
  bool fixed_a = false;     ///< A is fixed or kinematic
  bool in_use : 1 = false;  ///< the slot holds a pair, or a part of one
  /// A is a surface, or either body a compound: they may touch in several parts, each with its own contact.
  bool in_parts : 1 = false;
  bool is_part : 1 = false;            ///< one of these parts after the first: processed together with the first
  bool on_moving_surface : 1 = false;  ///< a body's surface moves relative to it; known once they have touched
  bool own_slide : 1 = false;          ///< the application has set its surface slide (`ContactGraph::give`)
  bool by_direction : 1 = false;       ///< its friction depends on direction; known once they have touched
  std::uint8_t unused_bits : 2 = 0;
  bool round : 1 = false;  ///< a body is a sphere or a capsule; known once they have touched
  /// The manifold was made where the bodies will meet (dynamics/look_ahead.hpp). Its `step_impulse` stores the time
  /// until then, as long as the step has no impulse.
  bool ahead : 1 = false;
  bool in_touch : 1 = false;            ///< the bodies touch, as events report (dynamics/touch.hpp)
  bool hits : 1 = false;                ///< the last step's hit continues
  std::uint8_t touch_halvings : 4 = 0;  ///< see `touch_distance`

  /// A pair's first contact, the one the narrow phase iterates over.
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
