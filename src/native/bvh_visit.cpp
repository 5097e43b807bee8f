// Finds what a moving box meets in the tree, nearest first.
//
// Rounding to single precision must not miss anything: in doubt, a box counts as met. Bounds are off by a few units in
// the last place of their coordinates, and are grown by that much here. Fractions have a relative error (T. Ize,
// "Robust BVH Ray Traversal", J. Computer Graphics Techniques 2, 2013).
#include <algorithm>
#include <bit>
#include <iterator>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "check/check.hpp"
#include "native/bvh.hpp"

namespace fathom::native {

namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<float, 8>;  // children of a node

constexpr float coordinate_rounding = 0x1p-21f, fraction_rounding = 0x1p-20f;

/// Slab test of eight boxes against a moving one (T. Kay, J. Kajiya, "Ray Tracing Complex Scenes", 1986).
class Slabs {
 public:
  explicit Slabs(const MovingBox& box) {
    for (int axis = 0; axis < 3; ++axis) {
      constexpr float least = 1e-20f;  // m; an axis without motion moves by this
      const float way = box.translation[axis], centre = box.centre[axis];
      const bool forward = way >= 0;
      const float per_way = 1.0f / (forward ? std::max(way, least) : std::min(way, -least));
      const float half = box.half[axis] + coordinate_rounding * (box.half[axis] + fathom::abs(centre));
      const auto lower = static_cast<std::size_t>(axis);
      sides_[axis] = forward ? Sides{lower, lower + 3} : Sides{lower + 3, lower};
      per_way_[axis] = hn::Set(d, per_way);
      rounding_[axis] = hn::Set(d, forward ? coordinate_rounding : -coordinate_rounding);
      from_near_[axis] = hn::Set(d, -(centre + (forward ? half : -half)) * per_way);
      from_far_[axis] = hn::Set(d, -(centre - (forward ? half : -half)) * per_way);
    }
  }

  /// Writes the fractions at which eight boxes are met; `sides` are their lower bounds by axis, then the upper ones.
  /// Returns a bit for each box met up to `limit`.
  HWY_INLINE std::uint32_t meets(const float* sides, float limit, float* fractions) const {
    constexpr std::size_t width = 8;
    std::uint32_t met = 0;
    for (std::size_t c = 0; c < width; c += hn::MaxLanes(d)) {
      auto enter = hn::Zero(d), leave = hn::Set(d, limit);
      for (int axis = 0; axis < 3; ++axis) {
        const auto near = hn::Load(d, sides + width * sides_[axis].near + c);
        const auto far = hn::Load(d, sides + width * sides_[axis].far + c);
        const auto room = hn::Mul(rounding_[axis], hn::Max(hn::Abs(near), hn::Abs(far)));
        enter = hn::Max(enter, hn::MulAdd(hn::Sub(near, room), per_way_[axis], from_near_[axis]));
        leave = hn::Min(leave, hn::MulAdd(hn::Add(far, room), per_way_[axis], from_far_[axis]));
      }
      hn::StoreU(enter, d, fractions + c);
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, hn::Le(enter, hn::Mul(leave, hn::Set(d, 1 + fraction_rounding))), bits);
      met |= std::uint32_t{bits[0]} << c;
    }
    return met;
  }

 private:
  /// Which of a box's sides is met first, and which last.
  struct Sides {
    std::size_t near, far;
  };
  static constexpr Lanes d{};
  Sides sides_[3];
  hn::Vec<Lanes> per_way_[3], from_near_[3], from_far_[3], rounding_[3];
};

}  // namespace

float Bvh::visit(const MovingBox& box, float limit, BodyVisitor& visitor) const {
  if (leaves_.empty()) return limit;
  const Slabs slabs(box);
  struct Entry {
    float fraction;
    std::uint32_t level, node;
  };
  Entry stack[width * 12];
  int top = 0;
  stack[top++] = {0, static_cast<std::uint32_t>(levels_.size() - 1), 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    FATHOM_ASSERT(static_cast<std::size_t>(top) + width <= std::size(stack));
    if (entry.fraction > limit * (1 + fraction_rounding)) continue;
    const Node& node = nodes_[levels_[entry.level].first + entry.node];
    const std::size_t first = std::size_t{entry.node} * width;
    alignas(32) float fractions[width];
    // Visits the nearest child first: the newest part of the stack is sorted, nearest last.
    Entry* const bottom = stack + top;
    for (std::uint32_t met = slabs.meets(node.lower[0], limit, fractions); met != 0; met &= met - 1) {
      const auto c = static_cast<std::size_t>(std::countr_zero(met));
      if (!has_child(entry.level, first + c)) break;
      const Entry child{fractions[c], entry.level - 1, static_cast<std::uint32_t>(first + c)};
      Entry* slot = stack + top++;
      for (; slot != bottom && slot[-1].fraction < child.fraction; --slot) *slot = slot[-1];
      *slot = child;
    }
    if (entry.level > 0) continue;
    while (stack + top != bottom) {
      const Entry& leaf = stack[--top];
      if (leaf.fraction > limit * (1 + fraction_rounding)) continue;
      const float next = visitor.visit(leaves_[leaf.node]);
      FATHOM_ASSERT(next >= 0 && next <= limit, leaves_[leaf.node]);
      limit = next;
    }
  }
  return limit;
}

}  // namespace fathom::native
