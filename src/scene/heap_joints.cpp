// Heaps with joints: those of scene/heap.hpp, with some bodies joined to neighbours.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "scene/heap.hpp"
#include "scene/heap_bodies.hpp"

namespace fathom {
namespace {

constexpr std::uint64_t joint_stream = 0x6a6f696e7473;  // keeps the bodies' random numbers unchanged
constexpr std::size_t first_body = 5;                   // after the floor and the walls
constexpr double max_ratio = 100;                       // of the masses of two joined bodies
constexpr std::size_t longest_chain = 12, max_limbs = 9;

/// Bodies at their initial poses, and whether a mechanism already includes them.
class Neighbours {
 public:
  explicit Neighbours(const std::vector<BodyDef>& bodies) : bodies_(bodies), taken_(bodies.size()) {
    for (const BodyDef& body : bodies) {
      radius_.push_back(outer_radius(body.shape));
      mass_.push_back(static_cast<double>(body.density * volume(body.shape)));
    }
  }

  bool is_free(std::size_t body) const { return !taken_[body]; }
  void take(std::size_t body) { taken_[body] = 1; }
  double radius(std::size_t body) const { return radius_[body]; }

  /// The nearest free body that may be joined to this one; itself if there is none.
  std::size_t next_to(std::size_t body) const {
    std::size_t nearest = body;
    double least = 1.4;  // of the sum of radii: farther ones would be joined by long rods
    for (std::size_t i = first_body; i < bodies_.size(); ++i) {
      const double ratio = mass_[i] / mass_[body];
      if (taken_[i] || i == body || ratio > max_ratio || ratio * max_ratio < 1) continue;
      const double apart = static_cast<double>(distance(bodies_[i].pose.position, bodies_[body].pose.position)) /
                           (radius_[i] + radius_[body]);
      if (apart < least) nearest = i, least = apart;
    }
    return nearest;
  }

 private:
  const std::vector<BodyDef>& bodies_;
  std::vector<char> taken_;
  std::vector<double> radius_, mass_;
};

float up_to(Random& random, double low, double high) { return static_cast<float>(low + (high - low) * random.unit()); }

/// A joint of any type that neither drives nor stores energy.
JointDef random_joint(Random& random, double arm) {
  JointDef joint = generic_joint({}, {}, {}, {});
  for (const auto axis : {JointAxisName::x, JointAxisName::y, JointAxisName::z})
    joint.axis(axis).mode = AxisMode::locked;
  JointAxis& twist = joint.axis(JointAxisName::twist);
  switch (random.bits() % 8) {
    case 0:
    case 1:
      return ball_joint({}, {}, {}, {});
    case 2:
    case 3:  // a limb
      twist.limit(-up_to(random, 0.1, 1), up_to(random, 0.1, 1));
      joint.cone_angle = up_to(random, 0.2, 1.2);
      return joint;
    case 4:
      joint = revolute_joint({}, {}, {}, {});
      if (random.bits() % 2 == 0)
        joint.axis(JointAxisName::twist).limit(-up_to(random, 0, 1.5), up_to(random, 0.1, 1.5));
      return joint;
    case 5:
      return fixed_joint({}, {}, {}, {});
    case 6:
      joint = prismatic_joint({}, {}, {}, {});
      joint.axis(JointAxisName::x).limit(-up_to(random, 0, 0.5 * arm), up_to(random, 0.05 * arm, 0.5 * arm));
      return joint;
    default:
      return distance_joint({}, {}, {}, {}, 0, up_to(random, 0, arm));
  }
}

void join(Random& random, Scene& scene, std::size_t a, std::size_t b, double arm) {
  const Vec3 from = scene.bodies[a].pose.position, to = scene.bodies[b].pose.position;
  SceneJoint joint{a, b, random_joint(random, arm)};
  // Where one ends and the other begins.
  const auto outer = [&](std::size_t i) { return static_cast<float>(outer_radius(scene.bodies[i].shape)); };
  const float share = outer(a) / (outer(a) + outer(b));
  joint.anchor_at(from + share * (to - from), scene.bodies);
  if (joint.def.type == JointType::generic) joint.turn_to(joint_frame({}, to - from).rotation, scene.bodies);
  scene.joints.push_back(joint);
}

/// Joins bodies from this one on, as a chain from neighbour to neighbour or as a trunk with limbs.
void add_mechanism(Random& random, Heap& heap, Neighbours& neighbours, std::size_t start, std::size_t size,
                   bool is_chain) {
  std::vector<std::size_t> parts{start};
  neighbours.take(start);
  while (parts.size() < size) {
    const std::size_t from = is_chain ? parts.back() : parts[random.bits() % parts.size()];
    const std::size_t next = neighbours.next_to(from);
    if (next == from) return;
    join(random, heap.scene, from, next, std::min(neighbours.radius(from), neighbours.radius(next)));
    neighbours.take(next);
    parts.push_back(next);
  }
}

}  // namespace

Heap make_joint_heap(std::uint64_t seed) {
  Heap heap = make_heap(seed);
  heap.scene.name = "joint_heap";
  Random random(seed ^ joint_stream);
  random.bits();
  if (heap.kind == HeapKind::stream) {  // a body that leaves would take its joints with it
    heap.kind = HeapKind::bin;
    heap.scene.stream.reset();
  }
  Neighbours neighbours(heap.scene.bodies);
  const double share = 0.2 + 0.6 * random.unit();
  for (std::size_t i = first_body; i < heap.scene.bodies.size(); ++i) {
    if (!neighbours.is_free(i) || random.unit() > share) continue;
    const std::uint64_t form = random.bits() % 3;
    const std::size_t size = form == 0   ? 2
                             : form == 1 ? 3 + random.bits() % (longest_chain - 2)
                                         : 4 + random.bits() % (max_limbs - 3);
    add_mechanism(random, heap, neighbours, i, size, form == 1);
  }
  return heap;
}

}  // namespace fathom
