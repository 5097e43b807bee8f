// Body data common to all simulators: ids, and data that a step only reads.
#pragma once

#include <cstdint>
#include <fathom/body.hpp>
#include <limits>
#include <span>
#include <vector>

#include "geometry/geometry.hpp"
#include "world/filter.hpp"

namespace fathom {

class ByteReader;
class ByteWriter;

/// The rarely changing data of one body. Simulators keep the state that a step changes.
struct alignas(16) BodyInfo {
  // For most bodies, a step reads only the first members, up to the shape.
  MotionType motion = MotionType::fixed;
  bool can_sleep = true;
  /// Inertia is a multiple of the identity: no gyroscopic torque, one number instead of six.
  bool isotropic = true;
  bool is_sensor : 1 = false;
  bool is_bullet : 1 = false;
  bool pre_solve : 1 = false;      ///< see BodyDef
  bool custom_filter : 1 = false;  ///< see BodyDef
  float radius = 0;                ///< of the bounding sphere about the centre of mass (m)
  float inverse_mass = 0;          ///< 1/kg, 0 unless dynamic
  float gravity_scale = 1;
  float linear_damping = 0;   ///< 1/s
  float angular_damping = 0;  ///< 1/s
  Geometry geometry;          ///< its last member is the view of the hull

  SymMat3 inertia;                         ///< body axes, 0 unless dynamic
  SymMat3 inverse_inertia;                 ///< body axes, 0 unless dynamic
  std::shared_ptr<const void> shape_data;  ///< owns the geometry of a hull, a surface or a compound
  Material material;                       ///< steps read it where contacts begin
  float mass = 0;                          ///< kg, 0 unless dynamic
  Filter filter;

  void set_shape(const Shape& shape);
  Shape shape() const;
  std::shared_ptr<const Hull> hull() const;  ///< null if the shape is not a hull
};
static_assert(sizeof(BodyInfo) == 272);

/// Sensors collide with nothing.
inline bool may_collide(const BodyInfo& a, const BodyInfo& b) {
  return !a.is_sensor && !b.is_sensor && may_collide(a.filter, b.filter);
}

/// Whether the body may collide with anything. Children of a compound may have their own filters.
inline bool may_collide(const BodyInfo& info) {
  const Filter& f = info.filter;
  return !info.is_sensor && (info.geometry.is_compound() || f.group > 0 || (f.category != 0 && f.mask != 0));
}

/// Whether continuous collision must keep these bodies, one of them fast, from tunnelling through each other. `a` is
/// the non-dynamic one.
inline bool is_swept(const BodyInfo& a, const BodyInfo& b) {
  return a.motion != MotionType::dynamic || a.is_bullet || b.is_bullet;
}

/// Approximately half the body's thickness (m).
float half_thickness(const BodyInfo& info);

/// Slots with generations: a removed body's slot is reused, its old ids are not.
class BodyTable {
 public:
  /// The slot that the next `add` will fill.
  std::uint32_t next_slot() const;
  /// `def` must have been checked (see `check_body`).
  BodyId add(const BodyDef& def);
  void remove(BodyId id);
  /// The definition that would recreate the body, without pose and velocity.
  BodyDef definition(std::uint32_t slot) const;
  /// Redefines the body in the slot under the same id. `def` must have been checked.
  void change(std::uint32_t slot, const BodyDef& def);

  bool contains(BodyId id) const {
    return id.index < generations_.size() && generations_[id.index] == id.generation && alive(id.index);
  }
  /// The slot of `id`; throws `Error{stale_id}` naming `action` if the body has been removed.
  std::uint32_t slot(BodyId id, const char* action) const;

  bool alive(std::uint32_t slot) const { return generations_[slot] & 1u; }
  BodyId id(std::uint32_t slot) const { return {slot, generations_[slot]}; }
  std::uint32_t slot_count() const { return static_cast<std::uint32_t>(generations_.size()); }
  std::uint32_t count() const { return count_; }
  /// True once any dynamic body was anisotropic: its inertia is not a multiple of the identity.
  bool any_anisotropic() const { return any_anisotropic_; }
  /// True once any body was a mesh, height field or compound: such bodies make several contacts per pair.
  bool any_in_parts() const { return any_in_parts_; }
  /// True once any body had a `custom_filter`.
  bool any_custom_filter() const { return any_custom_filter_; }
  void set_custom_filter(std::uint32_t slot, bool custom_filter);
  /// Slots of sensors, ascending.
  std::span<const std::uint32_t> sensors() const { return sensors_; }
  /// Slots of kinematic bodies, ascending.
  std::span<const std::uint32_t> kinematic() const { return kinematic_; }
  /// Slots of the bodies with `pre_solve`, ascending.
  std::span<const std::uint32_t> pre_solvers() const { return pre_solvers_; }
  void set_pre_solve(std::uint32_t slot, bool pre_solve);
  /// Half thickness of the thinnest dynamic body so far (m).
  float min_half_thickness() const { return min_half_thickness_; }
  /// Living bodies in ascending order of slot.
  std::span<const BodyId> living() const;
  void reserve(std::uint32_t bodies);
  std::size_t memory_bytes() const;

  void save(ByteWriter& write) const;
  /// Into an empty table. Throws `Error{file}` on impossible content.
  void restore(ByteReader& in);

  BodyInfo& operator[](std::uint32_t slot) { return infos_[slot]; }
  const BodyInfo& operator[](std::uint32_t slot) const { return infos_[slot]; }
  /// Stored separately, because no step reads it.
  std::uint64_t user_data(std::uint32_t slot) const { return user_data_[slot]; }
  void set_user_data(std::uint32_t slot, std::uint64_t data) { user_data_[slot] = data; }

 private:
  void note(const BodyInfo& info);
  void list(std::uint32_t slot, const BodyInfo& info);
  void note_thickness(const BodyInfo& info);

  std::vector<BodyInfo> infos_;
  std::vector<std::uint64_t> user_data_;
  std::vector<std::uint32_t> generations_;  // odd: alive
  std::vector<std::uint32_t> free_slots_;
  std::vector<std::uint32_t> sensors_, kinematic_, pre_solvers_;
  std::uint32_t count_ = 0;
  bool any_anisotropic_ = false, any_in_parts_ = false, any_custom_filter_ = false;
  float min_half_thickness_ = std::numeric_limits<float>::max();
  mutable std::vector<BodyId> living_;
  mutable bool living_is_current_ = true;
};

}  // namespace fathom
