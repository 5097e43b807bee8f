// The bodies of a snapshot.
#include "geometry/support.hpp"
#include "world/body_table.hpp"
#include "world/shape_archive.hpp"
#include "world/validate.hpp"

namespace fathom {

namespace {

template <class Archive, class Info>
void archive_info(Archive& a, Info& i) {
  bool is_sensor = i.is_sensor, is_bullet = i.is_bullet, pre_solve = i.pre_solve, custom_filter = i.custom_filter;
  a(i.motion, i.can_sleep, i.isotropic, is_sensor, is_bullet, pre_solve, custom_filter, i.radius, i.inverse_mass,
    i.gravity_scale, i.linear_damping, i.angular_damping, i.inertia, i.inverse_inertia, i.mass, i.filter);
  if constexpr (Archive::reading) {
    i.is_sensor = is_sensor, i.is_bullet = is_bullet;
    i.pre_solve = pre_solve, i.custom_filter = custom_filter;
  }
  archive_material(a, i.material);
}

/// Refuses what no body could have.
void check_info(ByteReader& in, const BodyInfo& info) {
  in.require(info.motion <= MotionType::dynamic);
  for (const float number : {info.mass, info.inverse_mass, info.radius}) in.require(number >= 0 && is_finite(number));
  in.require_valid([&] {
    check_material(info.material, "material");
    check_damping(info.linear_damping, info.angular_damping, "damping");
    check_finite({info.gravity_scale, 0, 0}, "gravity", "the scale");
  });
}

}  // namespace

void BodyTable::save(ByteWriter& write) const {
  write(generations_, free_slots_, any_anisotropic_);
  ShapeWriter shapes(write);
  for (const BodyId body : living()) {
    archive_info(write, infos_[body.index]);
    write(user_data_[body.index]);
    shapes.write(infos_[body.index].shape());
  }
}

void BodyTable::restore(ByteReader& in) {
  in(generations_, free_slots_, any_anisotropic_);
  infos_.assign(generations_.size(), {});
  user_data_.assign(generations_.size(), 0);
  living_is_current_ = false;
  count_ = 0;
  for (std::uint32_t slot = 0; slot < slot_count(); ++slot) count_ += alive(slot);
  in.require(count_ + free_slots_.size() == slot_count());
  for (const std::uint32_t slot : free_slots_) in.require(slot < slot_count() && !alive(slot));
  ShapeReader shapes(in);
  for (const BodyId body : living()) {
    BodyInfo& info = infos_[body.index];
    archive_info(in, info);
    in(user_data_[body.index]);
    check_info(in, info);
    info.set_shape(shapes.read());
    in.require(!info.geometry.is_surface() || info.motion != MotionType::dynamic);
    any_in_parts_ = any_in_parts_ || !info.geometry.is_convex();
    any_anisotropic_ = any_anisotropic_ || !info.isotropic;
    note_thickness(info);
    list(body.index, info);
  }
}

}  // namespace fathom
