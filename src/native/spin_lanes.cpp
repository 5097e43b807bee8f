#include "native/spin_lanes.hpp"

#include "dynamics/lane_eight.hpp"
#include "dynamics/rotation.hpp"
#include "math/eight_rows.hpp"
#include "native/body_state.hpp"

namespace fathom::native {

namespace {

/// With fewer bodies, each is faster alone.
constexpr std::size_t min_lanes = 3;

void spin_alone(const SpinningBodies& all, std::uint32_t slot, float h) {
  SolverBody& body = all.bodies[slot];
  const BodyInfo& info = all.table[slot];
  Quat& now = all.inertia[slot].rotation;
  const Quat start = all.poses[slot].rotation;
  const Vec3 by =
      fathom::spin_in_contact(now, start, body.angular, all.warm[slot], info.inertia, info.inverse_inertia, h);
  body.turned = all.flags && all.flags[slot] & jointed ? turned_so_far(now, start, turned_further(body.turned, by))
                                                       : body.turned + by;
}

struct Columns {
  Eight rows[8];

  template <class RowOf>
  explicit Columns(const RowOf& row_of) {
    for (std::size_t lane = 0; lane < spin_lanes; ++lane) rows[lane] = load_row(row_of(lane));
    transpose(rows);
  }
  Eight operator[](int i) const { return rows[i]; }
  wide::Vec3 vector(int i) const { return {rows[i], rows[i + 1], rows[i + 2]}; }
  void set(int i, const wide::Vec3& v) { rows[i] = v.x, rows[i + 1] = v.y, rows[i + 2] = v.z; }
  wide::Quat quaternion(int i) const { return {rows[i], rows[i + 1], rows[i + 2], rows[i + 3]}; }
  void set(int i, const wide::Quat& q) { rows[i] = q.w, rows[i + 1] = q.x, rows[i + 2] = q.y, rows[i + 3] = q.z; }
  template <class RowOf>
  void store(std::size_t used, const RowOf& row_of) {
    transpose(rows);
    for (std::size_t lane = 0; lane < used; ++lane) store_row(rows[lane], row_of(lane));
  }
};

}  // namespace

void spin_in_contact(const SpinningBodies& all, std::span<const std::uint32_t> slots, float h) {
  if (slots.size() < min_lanes) {
    for (const std::uint32_t slot : slots) spin_alone(all, slot, h);
    return;
  }
  const auto slot = [&](std::size_t lane) { return slots[lane < slots.size() ? lane : 0]; };
  // The halves of cache lines with rotational data, see dynamics/solver_body.hpp.
  const auto velocities = [&](std::size_t lane) { return &all.bodies[slot(lane)].linear.x; };
  const auto ways = [&](std::size_t lane) { return &all.bodies[slot(lane)].moved.x; };
  const auto references = [&](std::size_t lane) { return &all.warm[slot(lane)].linear_reference.x; };
  const auto rotations = [&](std::size_t lane) { return &all.inertia[slot(lane)].xz; };
  const auto poses = [&](std::size_t lane) { return &all.poses[slot(lane)].position.x; };
  const auto inertias = [&](std::size_t lane) { return &all.table[slot(lane)].inertia.xx; };
  const auto inverses = [&](std::size_t lane) { return &all.table[slot(lane)].inertia.xz; };
  Columns velocity(velocities), way(ways), reference(references), rotation(rotations);
  const Columns pose(poses), inertia(inertias), inverse(inverses);

  const wide::Vec3 before = velocity.vector(4);
  wide::Vec3 angular = before;
  const wide::Quat start = pose.quaternion(4);
  wide::Quat now = rotation.quaternion(4);
  const wide::SymMat3 moments{inertia[0], inertia[1], inertia[2], inertia[3], inertia[4], inertia[5]};
  const wide::SymMat3 responses{inverse[2], inverse[3], inverse[4], inverse[5], inverse[6], inverse[7]};
  const wide::Vec3 by = wide::step_torque_free_in_contact(now, start, angular, moments, responses, eight(h));
  wide::Vec3 turned = way.vector(4) + by;
  if (all.flags) {
    EightInts is_jointed{};
    for (std::size_t lane = 0; lane < spin_lanes; ++lane) is_jointed[lane] = all.flags[slot(lane)] & jointed ? -1 : 0;
    if (wide::anywhere(is_jointed))
      turned =
          wide::select(is_jointed, wide::turned_so_far(now, start, wide::turned_further(way.vector(4), by)), turned);
  }
  velocity.set(4, angular);
  way.set(4, turned);
  reference.set(4, reference.vector(4) + (angular - before));
  rotation.set(4, now);
  velocity.store(slots.size(), velocities);
  way.store(slots.size(), ways);
  reference.store(slots.size(), references);
  rotation.store(slots.size(), rotations);
}

}  // namespace fathom::native
