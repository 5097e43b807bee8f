#include "world/sensors.hpp"

#include <algorithm>
#include <tuple>

#include "geometry/any_query.hpp"
#include "geometry/compound_query.hpp"
#include "world/archive.hpp"
#include "world/simulator.hpp"

namespace fathom {

namespace {

bool sorts_before(const Presence& x, const Presence& y) {
  const auto key = [](const Presence& p) {
    return std::tuple(p.sensor.index, p.sensor.generation, p.body.index, p.body.generation);
  };
  return key(x) < key(y);
}

bool may_see(const BodyInfo& sensor, const BodyInfo& body) {
  if (body.is_sensor || !may_collide(sensor.filter, body.filter)) return false;
  return sensor.motion != MotionType::fixed || body.motion != MotionType::fixed;
}

}  // namespace

void Sensors::begin_step(const Simulator& simulator) {
  simulator.collects_events() ? begun.begin_step() : begun.clear();
  simulator.collects_events() ? ended.begin_step() : ended.clear();
  if (simulator.bodies.sensors().empty()) return;
  simulator.synchronise();
  const std::span<const Pose> poses = simulator.poses();
  before_.assign(poses.begin(), poses.end());
}

void Sensors::end_step(const Simulator& simulator) {
  if (simulator.bodies.sensors().empty() && inside_.empty()) return;
  simulator.synchronise();
  const std::span<const Pose> poses = simulator.prepare_queries();
  present_.clear(), passed_.clear(), came_.clear(), left_.clear();
  if (!simulator.bodies.sensors().empty()) look_at_movements(simulator, poses);
  for (const std::uint32_t sensor : simulator.bodies.sensors()) look_at(sensor, simulator, poses);
  std::ranges::set_difference(present_, inside_, std::back_inserter(came_), sorts_before);
  std::ranges::set_difference(inside_, present_, std::back_inserter(left_), sorts_before);
  const auto tell = [&](std::vector<Presence>& list, EventList<SensorEvent>& events) {
    list.insert(list.end(), passed_.begin(), passed_.end());
    std::ranges::sort(list, sorts_before);
    events_.clear();
    for (const Presence& p : list) events_.push_back({p.sensor, p.body, simulator.steps});
    events.add(events_);
  };
  tell(came_, begun);
  tell(left_, ended);
  inside_.swap(present_);
}

// The few bodies that move farther than their own radius within a step are tested against every sensor. Otherwise they
// would widen every sensor's search by the length of their path.
void Sensors::look_at_movements(const Simulator& simulator, std::span<const Pose> poses) {
  fast_.clear();
  reach_ = 0;
  for (const BodyId id : simulator.bodies.living()) {
    const Vec3 way = poses[id.index].position - before_[id.index].position;
    if (way == Vec3{}) continue;
    const BodyInfo& info = simulator.bodies[id.index];
    if (info.is_sensor) continue;
    const float moved = max_component(abs(way));
    if (moved > info.radius)
      fast_.push_back(id.index);
    else
      reach_ = max(reach_, moved);
  }
}

void Sensors::look_at(std::uint32_t sensor, const Simulator& simulator, std::span<const Pose> poses) {
  const BodyTable& bodies = simulator.bodies;
  const BodyInfo& info = bodies[sensor];
  const Pose& pose = poses[sensor];
  const Vec3 own_way = pose.position - before_[sensor].position;
  const Aabb box = tight_bounds(info.geometry, pose);
  const float reach = reach_ + max_component(abs(own_way));
  struct Found final : BodyVisitor {
    explicit Found(std::vector<std::uint32_t>& list) : slots(list) {}
    float visit(std::uint32_t slot) override {
      slots.push_back(slot);
      return 1;
    }
    std::vector<std::uint32_t>& slots;
  } found(candidates_);
  candidates_.assign(fast_.begin(), fast_.end());
  simulator.visit_bodies({centre(box), half_extents(box) + Vec3{reach, reach, reach}, {}}, found);
  std::ranges::sort(candidates_);
  candidates_.erase(std::unique(candidates_.begin(), candidates_.end()), candidates_.end());

  for (const std::uint32_t slot : candidates_) {
    const BodyInfo& body = bodies[slot];
    if (!may_see(info, body) || simulator.excluded.contains(sensor, slot)) continue;
    const Vec3 way = poses[slot].position - before_[slot].position - own_way;
    const Aabb end = tight_bounds(body.geometry, poses[slot]);
    if (!overlaps(merged(end, {end.lower - way, end.upper - way}), box)) continue;
    const Presence presence{bodies.id(sensor), bodies.id(slot)};
    if (overlaps(end, box) && touch(body.geometry, poses[slot], info.geometry, pose)) {
      present_.push_back(presence);
      continue;
    }
    if (way == Vec3{} || was_inside(presence)) continue;
    const Pose start{poses[slot].position - way, 0, poses[slot].rotation};
    if (touch_on_way(body.geometry, start, way, info.geometry, pose)) passed_.push_back(presence);
  }
}

bool Sensors::was_inside(const Presence& presence) const {
  return std::ranges::binary_search(inside_, presence, sorts_before);
}

std::span<const Presence> Sensors::inside(BodyId sensor) const {
  const std::pair own(sensor.index, sensor.generation);
  const auto sensor_of = [](const Presence& p) { return std::pair(p.sensor.index, p.sensor.generation); };
  return {std::ranges::lower_bound(inside_, own, {}, sensor_of), std::ranges::upper_bound(inside_, own, {}, sensor_of)};
}

void Sensors::save(ByteWriter& write, std::uint64_t step) const {
  write(inside_, begun.of_step(step), ended.of_step(step));
}

void Sensors::restore(ByteReader& in) {
  std::vector<SensorEvent> came, left;
  in(inside_, came, left);
  in.require(std::ranges::is_sorted(inside_, sorts_before));
  begun.add(came);
  ended.add(left);
}

}  // namespace fathom
