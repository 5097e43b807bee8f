#include "world/body_table.hpp"

#include <algorithm>
#include <fathom/error.hpp>
#include <string>

#include "dynamics/overlap.hpp"
#include "geometry/support.hpp"
#include "math/text.hpp"
#include "math/vec3d.hpp"
#include "world/growth.hpp"

namespace fathom {

namespace {

bool is_isotropic(const SymMat3& m) {
  const float mean = (m.xx + m.yy + m.zz) / 3;
  const float spread = max(max(abs(m.xx - mean), abs(m.yy - mean)), abs(m.zz - mean));
  const float mixed = max(max(abs(m.xy), abs(m.xz)), abs(m.yz));
  return max(spread, mixed) <= 1e-5f * mean;
}

/// In double precision: in single, the product of three moments of a tiny body underflows.
SymMat3 inverse(const SymMat3& m) {
  const double xx = to_double(m.xx), yy = to_double(m.yy), zz = to_double(m.zz), xy = to_double(m.xy),
               xz = to_double(m.xz), yz = to_double(m.yz);
  const double a = yy * zz - yz * yz, b = xz * yz - xy * zz, c = xy * yz - xz * yy;
  const double s = 1 / (xx * a + xy * b + xz * c);
  const auto scaled = [&](double v) { return static_cast<float>(s * v); };
  return {scaled(a), scaled(xx * zz - xz * xz), scaled(xx * yy - xy * xy), scaled(b),
          scaled(c), scaled(xy * xz - xx * yz)};
}

bool can_be_moved(const BodyInfo& info) {
  const SymMat3& i = info.inverse_inertia;
  const float sum = info.inverse_mass + i.xx + i.yy + i.zz + abs(i.xy) + abs(i.xz) + abs(i.yz);
  return is_finite(sum) && info.inverse_mass > 0 && i.xx > 0 && i.yy > 0 && i.zz > 0;
}

BodyInfo make_info(const BodyDef& def) {
  BodyInfo info;
  info.motion = def.motion;
  info.can_sleep = def.can_sleep;
  info.is_sensor = def.sensor;
  info.is_bullet = def.bullet;
  info.pre_solve = def.pre_solve;
  info.custom_filter = def.custom_filter;
  info.set_shape(def.shape);
  info.radius = bounding_radius(info.geometry);
  info.gravity_scale = def.gravity_scale;
  info.linear_damping = def.linear_damping;
  info.angular_damping = def.angular_damping;
  info.material = def.material;
  info.filter = def.filter;
  if (def.motion == MotionType::dynamic) {
    info.mass = def.mass ? *def.mass : def.density * volume(def.shape);
    info.inverse_mass = 1 / info.mass;
    info.inertia = def.inertia ? *def.inertia : mass_properties(def.shape, info.mass).inertia;
    info.isotropic = is_isotropic(info.inertia);
    if (info.isotropic) info.inertia.xy = info.inertia.xz = info.inertia.yz = 0;
    if (info.isotropic) info.inertia.yy = info.inertia.zz = info.inertia.xx;
    info.inverse_inertia = inverse(info.inertia);
    if (!can_be_moved(info))
      throw Error(ErrorCode::invalid_argument, "add body: its mass of " + text(to_double(info.mass)) +
                                                   " kg or its inertia is beyond what single precision can " +
                                                   "invert; give it a mass and a size nearer to 1");
  }
  return info;
}

}  // namespace

void BodyInfo::set_shape(const Shape& shape) {
  geometry = fathom::geometry(shape);
  shape_data = shape.hull;
  if (shape.is_surface()) shape_data = shape.surface;
  if (shape.compound) shape_data = shape.compound;
}

Shape BodyInfo::shape() const {
  Shape shape{geometry.type, geometry.radius, geometry.half_extents};
  if (geometry.type == ShapeType::hull) shape.half_extents = {}, shape.hull = hull();
  if (geometry.is_compound())
    shape.half_extents = {}, shape.compound = std::static_pointer_cast<const Compound>(shape_data);
  if (geometry.is_surface()) shape.surface = std::static_pointer_cast<const Surface>(shape_data);
  return shape;
}

std::shared_ptr<const Hull> BodyInfo::hull() const {
  return geometry.type == ShapeType::hull ? std::static_pointer_cast<const Hull>(shape_data) : nullptr;
}

std::uint32_t BodyTable::next_slot() const { return free_slots_.empty() ? slot_count() : free_slots_.back(); }

float half_thickness(const BodyInfo& info) {
  const Geometry& shape = info.geometry;
  return half_thickness(shape.type, shape.half_extents, shape.radius);
}

void BodyTable::note_thickness(const BodyInfo& info) {
  if (info.motion == MotionType::dynamic) min_half_thickness_ = min(min_half_thickness_, half_thickness(info));
}

void BodyTable::note(const BodyInfo& info) {
  any_anisotropic_ = any_anisotropic_ || !info.isotropic;
  any_in_parts_ = any_in_parts_ || !info.geometry.is_convex();
  note_thickness(info);
}

/// Inserts the slot into a sorted list, or removes it.
static void list_in(std::vector<std::uint32_t>& list, std::uint32_t slot, bool belongs) {
  if (!belongs && list.empty()) return;
  const auto entry = std::ranges::lower_bound(list, slot);
  const bool was_there = entry != list.end() && *entry == slot;
  if (belongs && !was_there) list.insert(entry, slot);
  if (!belongs && was_there) list.erase(entry);
}

void BodyTable::list(std::uint32_t slot, const BodyInfo& info) {
  list_in(sensors_, slot, info.is_sensor);
  list_in(kinematic_, slot, info.motion == MotionType::kinematic);
  list_in(pre_solvers_, slot, info.pre_solve);
  any_custom_filter_ = any_custom_filter_ || info.custom_filter;
}

void BodyTable::set_pre_solve(std::uint32_t slot, bool pre_solve) {
  infos_[slot].pre_solve = pre_solve;
  list(slot, infos_[slot]);
}

void BodyTable::set_custom_filter(std::uint32_t slot, bool custom_filter) {
  infos_[slot].custom_filter = custom_filter;
  list(slot, infos_[slot]);
}

BodyDef BodyTable::definition(std::uint32_t slot) const {
  const BodyInfo& info = infos_[slot];
  BodyDef def;
  def.motion = info.motion;
  def.shape = info.shape();
  def.material = info.material;
  def.filter = info.filter;
  if (info.motion == MotionType::dynamic) def.mass = info.mass, def.inertia = info.inertia;
  def.gravity_scale = info.gravity_scale;
  def.linear_damping = info.linear_damping;
  def.angular_damping = info.angular_damping;
  def.can_sleep = info.can_sleep;
  def.sensor = info.is_sensor;
  def.bullet = info.is_bullet;
  def.pre_solve = info.pre_solve;
  def.custom_filter = info.custom_filter;
  def.user_data = user_data_[slot];
  return def;
}

void BodyTable::change(std::uint32_t slot, const BodyDef& def) {
  BodyInfo info = make_info(def);
  note(info);
  list(slot, info);
  infos_[slot] = std::move(info);
  user_data_[slot] = def.user_data;
}

BodyId BodyTable::add(const BodyDef& def) {
  BodyInfo info = make_info(def);
  note(info);
  const std::uint32_t slot = next_slot();
  list(slot, info);
  if (slot == slot_count()) {
    make_room(infos_, infos_.size() + 1);
    infos_.push_back(std::move(info));
    make_room(user_data_, infos_.size());
    user_data_.push_back(0);
    generations_.push_back(1);
  } else {
    infos_[slot] = std::move(info);
    ++generations_[slot];
    free_slots_.pop_back();
  }
  user_data_[slot] = def.user_data;
  ++count_;
  if (living_is_current_ && (living_.empty() || living_.back().index < slot))
    living_.push_back(id(slot));
  else
    living_is_current_ = false;
  return id(slot);
}

void BodyTable::remove(BodyId id) {
  infos_[id.index] = {};
  list(id.index, infos_[id.index]);
  ++generations_[id.index];
  free_slots_.push_back(id.index);
  --count_;
  living_is_current_ = false;
}

std::uint32_t BodyTable::slot(BodyId id, const char* action) const {
  if (contains(id)) return id.index;
  const bool existed = id.index < generations_.size() && id.generation <= generations_[id.index];
  throw Error(ErrorCode::stale_id, std::string(action) + ": body {index " + std::to_string(id.index) + ", generation " +
                                       std::to_string(id.generation) + "} " +
                                       (existed ? "was removed" : "never existed in this world") +
                                       "; ask World::contains before using an id that may be gone");
}

std::span<const BodyId> BodyTable::living() const {
  if (!living_is_current_) {
    living_.clear();
    living_.reserve(count_);
    for (std::uint32_t slot = 0; slot < slot_count(); ++slot)
      if (alive(slot)) living_.push_back(id(slot));
    living_is_current_ = true;
  }
  return living_;
}

void BodyTable::reserve(std::uint32_t bodies) {
  infos_.reserve(bodies);
  user_data_.reserve(bodies);
  generations_.reserve(bodies);
  living_.reserve(bodies);
}

std::size_t BodyTable::memory_bytes() const {
  return infos_.capacity() * sizeof(BodyInfo) + user_data_.capacity() * sizeof(std::uint64_t) +
         generations_.capacity() * sizeof(std::uint32_t) + free_slots_.capacity() * sizeof(std::uint32_t) +
         living_.capacity() * sizeof(BodyId);
}

}  // namespace fathom
