#include "native/bvh.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "native/prefetch.hpp"
#include "native/radix_sort.hpp"

namespace fathom::native {

namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<float, 8>;  // children of a node

// 21 bits to every third bit of 63.
std::uint64_t spread_bits(std::uint64_t x) {
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

int exponent(float x) { return !(x > 0) ? -126 : is_finite(x) ? std::ilogb(x) : 127; }

float largest_extent(const Aabb& box) { return max_component(box.upper - box.lower); }

// The exponent of two of the median of the boxes' largest extents, from a histogram.
int median_exponent(std::span<const std::uint32_t> items, const Aabb* boxes) {
  std::array<std::uint32_t, 256> histogram{};
  for (const std::uint32_t item : items)
    ++histogram[static_cast<std::size_t>(exponent(largest_extent(boxes[item])) + 127) & 255];
  std::size_t seen = 0;
  for (int e = 0; e < 256; ++e)
    if ((seen += histogram[static_cast<std::size_t>(e)]) * 2 >= items.size()) return e - 127;
  return 0;
}

constexpr int morton_bits = 20;  // per axis

struct Quantiser {
  Vec3 lower;
  float scale;

  std::uint64_t operator()(Vec3 p) const {
    constexpr float cells = static_cast<float>(1 << morton_bits) - 1;
    const Vec3 cell = scale * (p - lower);
    const auto index = [](float c) { return static_cast<std::uint64_t>(clamp(c, 0.0f, cells)); };
    return spread_bits(index(cell.x)) | spread_bits(index(cell.y)) << 1 | spread_bits(index(cell.z)) << 2;
  }
};

Quantiser quantiser(std::span<const std::uint32_t> items, const Aabb* boxes) {
  Aabb range{centre(boxes[items[0]]), centre(boxes[items[0]])};
  for (const std::uint32_t item : items) {
    const Vec3 c = centre(boxes[item]);
    range = {min(range.lower, c), max(range.upper, c)};
  }
  // One scale for all axes keeps the cells cubes.
  const float extent = max_component(range.upper - range.lower);
  return {range.lower, extent > 0 ? static_cast<float>(1 << morton_bits) / extent : 0.0f};
}

constexpr float infinity = std::numeric_limits<float>::infinity();

}  // namespace

void Bvh::build(std::span<const std::uint32_t> items, const Aabb* boxes, ThreadPool& pool) {
  ++times_built_;
  leaves_.resize(items.size());
  levels_.clear();
  area_ = area_when_built_ = 0;
  if (items.empty()) return;
  keys_.resize(items.size());
  const int median = median_exponent(items, boxes);
  const Quantiser quantise = quantiser(items, boxes);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Aabb& box = boxes[items[i]];
    const auto size_class = static_cast<std::uint64_t>(std::clamp((exponent(largest_extent(box)) - median) / 3, 0, 3));
    keys_[i] = {size_class << (3 * morton_bits) | quantise(centre(box)), items[i]};
  }
  // Equal codes keep the order of the items.
  radix_sort(keys_, sorted_, 3 * morton_bits + 2, [](const Key& key) { return key.code; });
  for (std::size_t i = 0; i < items.size(); ++i) leaves_[i] = keys_[i].item;
  lay_out_levels();
  refit(boxes, pool);
  area_when_built_ = area_;
}

void Bvh::lay_out_levels() {
  std::size_t first = 0;
  std::size_t count = leaves_.size();
  do {
    count = (count + width - 1) / width;
    levels_.push_back({first, count});
    first += count;
  } while (count > 1);
  nodes_.resize(first);
}

void Bvh::set_child(Node& node, std::size_t child, const Aabb& box) {
  for (int axis = 0; axis < 3; ++axis) {
    node.lower[axis][child] = box.lower[axis];
    node.upper[axis][child] = box.upper[axis];
  }
}

// Other threads have read the node: only what changed is written, so that the rest stays in their caches.
void Bvh::replace(Node& node, const Node& by) {
  const Lanes d;
  float *to = node.lower[0], *end = to + 6 * width;
  for (const float* from = by.lower[0]; to != end; to += hn::Lanes(d), from += hn::Lanes(d)) {
    const auto value = hn::Load(d, from);
    if (!hn::AllTrue(d, hn::Eq(value, hn::Load(d, to)))) hn::Store(value, d, to);
  }
}

Aabb Bvh::box_of(const Node& node) {
  const Lanes d;
  float lower[3], upper[3];
  for (int axis = 0; axis < 3; ++axis) {
    auto low = hn::Load(d, node.lower[axis]), high = hn::Load(d, node.upper[axis]);
    for (std::size_t c = hn::Lanes(d); c < width; c += hn::Lanes(d)) {
      low = hn::Min(low, hn::Load(d, node.lower[axis] + c));
      high = hn::Max(high, hn::Load(d, node.upper[axis] + c));
    }
    lower[axis] = hn::GetLane(hn::MinOfLanes(d, low));
    upper[axis] = hn::GetLane(hn::MaxOfLanes(d, high));
  }
  return {{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}};
}

namespace {

constexpr Aabb empty_box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
constexpr std::size_t least_subtrees = 2;
constexpr std::size_t node_grain = 16;
constexpr std::size_t nodes_ahead = 2;

}  // namespace

// Subtrees of two levels by all threads, each with its box in the node above, and then what little there is above.
void Bvh::refit(const Aabb* boxes, ThreadPool& pool) {
  if (leaves_.empty()) return;
  const std::size_t subtrees = (levels_[0].count + width - 1) / width;
  areas_.assign(subtrees, 0.0);
  pool.for_each_part(subtrees, least_subtrees, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) refit_subtree(boxes, i);
  });
  area_ = 0;
  for (const double area : areas_) area_ += area;
  for (std::size_t level = 3; level < levels_.size(); ++level)
    pool.for_each_chunk(levels_[level].count, node_grain,
                        [&](std::size_t begin, std::size_t end) { refit_level(level, begin, end); });
}

// `root` is a node of level 1, if there is one.
void Bvh::refit_subtree(const Aabb* boxes, std::size_t root) {
  areas_[root] = refit_parents(boxes, root * width, std::min((root + 1) * width, levels_[0].count));
  if (levels_.size() == 1) return;
  refit_level(1, root, root + 1);
  if (levels_.size() == 2) return;
  const std::size_t parent = root / width;
  Node& above = nodes_[levels_[2].first + parent];
  set_child(above, root % width, box_of(nodes_[levels_[1].first + root]));
  if (root + 1 == levels_[1].count)
    for (std::size_t c = root % width + 1; c < width; ++c) set_child(above, c, empty_box);
}

// Nodes whose children are leaves. Their area tells how loose the tree has become.
double Bvh::refit_parents(const Aabb* boxes, std::size_t begin, std::size_t end) {
  double area = 0;
  static_assert(sizeof(Aabb) == 6 * sizeof(float));
  const Lanes d;
  const hn::RebindToSigned<Lanes> indices;
  Node node;
  for (std::size_t n = begin; n < end; ++n) {
    for (std::size_t leaf = (n + nodes_ahead) * width; leaf < std::min((n + nodes_ahead + 1) * width, leaves_.size());
         ++leaf)
      prefetch_to_read(&boxes[leaves_[leaf]]);
    if ((n + 1) * width <= leaves_.size()) {
      const float* const base = &boxes[0].lower.x;
      for (std::size_t c = 0; c < width; c += hn::Lanes(d)) {
        const auto leaf = hn::LoadU(indices, reinterpret_cast<const std::int32_t*>(&leaves_[n * width + c]));
        const auto at = hn::Add(hn::ShiftLeft<2>(leaf), hn::ShiftLeft<1>(leaf));
        for (int axis = 0; axis < 3; ++axis) {
          hn::Store(hn::GatherIndex(d, base, hn::Add(at, hn::Set(indices, axis))), d, node.lower[axis] + c);
          hn::Store(hn::GatherIndex(d, base, hn::Add(at, hn::Set(indices, axis + 3))), d, node.upper[axis] + c);
        }
      }
    } else {
      for (std::size_t c = 0; c < width; ++c)
        set_child(node, c, n * width + c < leaves_.size() ? boxes[leaves_[n * width + c]] : empty_box);
    }
    replace(nodes_[n], node);
    area += static_cast<double>(surface_area(box_of(node)));
  }
  return area;
}

void Bvh::refit_level(std::size_t level, std::size_t begin, std::size_t end) {
  const Level below = levels_[level - 1];
  Node node;
  for (std::size_t n = begin; n < end; ++n) {
    for (std::size_t c = 0; c < width; ++c) {
      const std::size_t child = n * width + c;
      set_child(node, c, child < below.count ? box_of(nodes_[below.first + child]) : empty_box);
    }
    replace(nodes_[levels_[level].first + n], node);
  }
}

void Bvh::overlap(const Aabb& box, std::vector<std::uint32_t>& found) const {
  if (leaves_.empty()) return;
  const Lanes d;
  constexpr std::size_t lanes = hn::MaxLanes(Lanes());
  const auto lower_x = hn::Set(d, box.lower.x), lower_y = hn::Set(d, box.lower.y), lower_z = hn::Set(d, box.lower.z);
  const auto upper_x = hn::Set(d, box.upper.x), upper_y = hn::Set(d, box.upper.y), upper_z = hn::Set(d, box.upper.z);
  struct Entry {
    std::uint32_t level, node;
  };
  Entry stack[width * 12];
  int top = 0;
  stack[top++] = {static_cast<std::uint32_t>(levels_.size() - 1), 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    const Node& node = nodes_[levels_[entry.level].first + entry.node];
    for (std::size_t c = 0; c < width; c += lanes) {
      const auto x =
          hn::And(hn::Le(hn::Load(d, node.lower[0] + c), upper_x), hn::Ge(hn::Load(d, node.upper[0] + c), lower_x));
      const auto y =
          hn::And(hn::Le(hn::Load(d, node.lower[1] + c), upper_y), hn::Ge(hn::Load(d, node.upper[1] + c), lower_y));
      const auto z =
          hn::And(hn::Le(hn::Load(d, node.lower[2] + c), upper_z), hn::Ge(hn::Load(d, node.upper[2] + c), lower_z));
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, hn::And(x, hn::And(y, z)), bits);
      for (std::uint32_t mask = bits[0]; mask != 0; mask &= mask - 1) {
        const std::size_t child = entry.node * width + c + static_cast<std::size_t>(std::countr_zero(mask));
        if (!has_child(entry.level, child)) continue;
        if (entry.level > 0)
          stack[top++] = {entry.level - 1, static_cast<std::uint32_t>(child)};
        else
          found.push_back(leaves_[child]);
      }
    }
  }
}

std::size_t Bvh::memory_bytes() const {
  return leaves_.capacity() * sizeof(std::uint32_t) + nodes_.capacity() * sizeof(Node) +
         (keys_.capacity() + sorted_.capacity()) * sizeof(Key);
}

}  // namespace fathom::native
