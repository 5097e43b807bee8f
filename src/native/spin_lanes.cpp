#include "native/spin_lanes.hpp"

#include <algorithm>

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

void spin_freely_alone(FreeSpins& s, int lane, float h, int substeps, float most) {
  const BodyInfo& info = *s.bodies[static_cast<std::size_t>(lane)];
  const auto vector = [lane](const Eight(&of)[3]) { return Vec3{of[0][lane], of[1][lane], of[2][lane]}; };
  Quat q{s.rotation[0][lane], s.rotation[1][lane], s.rotation[2][lane], s.rotation[3][lane]};
  Vec3 w = vector(s.angular);
  fathom::spin_freely(q, w, vector(s.acceleration), s.damping[lane], info.inertia, info.inverse_inertia, h, substeps,
                      most);
  s.rotation[0][lane] = q.w, s.rotation[1][lane] = q.x, s.rotation[2][lane] = q.y, s.rotation[3][lane] = q.z;
  s.angular[0][lane] = w.x, s.angular[1][lane] = w.y, s.angular[2][lane] = w.z;
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

/// Inertia and its inverse of the bodies `of(lane)`.
struct Moments {
  wide::SymMat3 inertia, inverse;

  template <class InfoOf>
  explicit Moments(const InfoOf& of) {
    const Columns first([&](std::size_t lane) { return &of(lane).inertia.xx; });
    const Columns last([&](std::size_t lane) { return &of(lane).inertia.xz; });
    inertia = {first[0], first[1], first[2], first[3], first[4], first[5]};
    inverse = {last[2], last[3], last[4], last[5], last[6], last[7]};
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
  Columns velocity(velocities), way(ways), reference(references), rotation(rotations);
  const Columns pose(poses);
  const Moments moments([&](std::size_t lane) -> const BodyInfo& { return all.table[slot(lane)]; });

  const wide::Vec3 before = velocity.vector(4);
  wide::Vec3 angular = before;
  const wide::Quat start = pose.quaternion(4);
  wide::Quat now = rotation.quaternion(4);
  const wide::Vec3 by =
      wide::step_torque_free_in_contact(now, start, angular, moments.inertia, moments.inverse, eight(h));
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

void spin_freely(FreeSpins& spins, float h, int substeps, float most) {
  const auto& bodies = spins.bodies;
  const auto used = static_cast<std::size_t>(std::ranges::count_if(bodies, [](auto* body) { return body != nullptr; }));
  if (used < min_lanes) {
    for (std::size_t lane = 0; lane < spin_lanes; ++lane)
      if (bodies[lane]) spin_freely_alone(spins, static_cast<int>(lane), h, substeps, most);
    return;
  }
  const BodyInfo& any = **std::ranges::find_if(bodies, [](auto* body) { return body != nullptr; });
  const Moments moments([&](std::size_t lane) -> const BodyInfo& { return bodies[lane] ? *bodies[lane] : any; });
  const auto vector = [](const Eight(&of)[3]) { return wide::Vec3{of[0], of[1], of[2]}; };
  wide::Quat q{spins.rotation[0], spins.rotation[1], spins.rotation[2], spins.rotation[3]};
  wide::Vec3 w = vector(spins.angular);
  wide::spin_freely(q, w, vector(spins.acceleration), spins.damping, moments.inertia, moments.inverse, eight(h),
                    substeps, eight(most));
  spins.rotation[0] = q.w, spins.rotation[1] = q.x, spins.rotation[2] = q.y, spins.rotation[3] = q.z;
  spins.angular[0] = w.x, spins.angular[1] = w.y, spins.angular[2] = w.z;
}

}  // namespace fathom::native
