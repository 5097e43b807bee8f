#include "native/bvh.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#define HWY_DISABLE_PCLMUL_AES
#include <hwy/highway.h>

#include "native/prefetch.hpp"
#include "native/radix_sort.hpp"

namespace fathom::native {

namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = hn::CappedTag<float, 8>;  // children of a node

// Spreads 21 bits to every third bit of 63.
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

// Binary exponent of the median of the boxes' largest extents, from a histogram.
int median_exponent(std::span<const std::uint32_t> items, const BodyBounds* bounds) {
  std::array<std::uint32_t, 256> histogram{};
  for (const std::uint32_t item : items)
    ++histogram[static_cast<std::size_t>(exponent(largest_extent(bounds[item].fat_box)) + 127) & 255];
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

Quantiser quantiser(std::span<const std::uint32_t> items, const BodyBounds* bounds) {
  Aabb range{centre(bounds[items[0]].fat_box), centre(bounds[items[0]].fat_box)};
  for (const std::uint32_t item : items) {
    const Vec3 c = centre(bounds[item].fat_box);
    range = {min(range.lower, c), max(range.upper, c)};
  }
  // One scale for all axes keeps the cells cubic.
  const float extent = max_component(range.upper - range.lower);
  return {range.lower, extent > 0 ? static_cast<float>(1 << morton_bits) / extent : 0.0f};
}

constexpr float infinity = std::numeric_limits<float>::infinity();

}  // namespace

void Bvh::build(std::span<const std::uint32_t> items, const BodyBounds* bounds, ThreadPool& pool) {
  ++times_built_, ++version_;
  leaves_.resize(items.size());
  levels_.clear();
  area_ = area_when_built_ = 0;
  if (items.empty()) return;
  keys_.resize(items.size());
  const int median = median_exponent(items, bounds);
  const Quantiser quantise = quantiser(items, bounds);
  for (std::size_t i = 0; i < items.size(); ++i) {
    const Aabb& box = bounds[items[i]].fat_box;
    const auto size_class = static_cast<std::uint64_t>(std::clamp((exponent(largest_extent(box)) - median) / 3, 0, 3));
    keys_[i] = {size_class << (3 * morton_bits) | quantise(centre(box)), items[i]};
  }
  // Equal codes keep the order of the items.
  radix_sort(keys_, sorted_, 3 * morton_bits + 2, [](const Key& key) { return key.code; });
  for (std::size_t i = 0; i < items.size(); ++i) leaves_[i] = keys_[i].item;
  lay_out_levels();
  refit(bounds, pool);
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

// Other threads have read the node: writing only what changed keeps the rest valid in their caches.
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
constexpr std::size_t min_subtrees = 2;
constexpr std::size_t node_grain = 16;
constexpr std::size_t nodes_ahead = 2;

}  // namespace

// All threads refit subtrees of two levels, writing each one's box into the node above; one thread refits the few
// levels above.
void Bvh::refit(const BodyBounds* bounds, ThreadPool& pool) {
  ++version_;
  if (leaves_.empty()) return;
  const std::size_t subtrees = (levels_[0].count + width - 1) / width;
  areas_.assign(subtrees, 0.0);
  pool.for_each_part(subtrees, min_subtrees, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) refit_subtree(bounds, i);
  });
  area_ = 0;
  for (const double area : areas_) area_ += area;
  for (std::size_t level = 3; level < levels_.size(); ++level)
    pool.for_each_chunk(levels_[level].count, node_grain,
                        [&](std::size_t begin, std::size_t end) { refit_level(level, begin, end); });
}

// `root` is a node of level 1, if that level exists.
void Bvh::refit_subtree(const BodyBounds* bounds, std::size_t root) {
  areas_[root] = refit_parents(bounds, root * width, std::min((root + 1) * width, levels_[0].count));
  if (levels_.size() == 1) return;
  refit_level(1, root, root + 1);
  if (levels_.size() == 2) return;
  const std::size_t parent = root / width;
  Node& above = nodes_[levels_[2].first + parent];
  set_child(above, root % width, box_of(nodes_[levels_[1].first + root]));
  if (root + 1 == levels_[1].count)
    for (std::size_t c = root % width + 1; c < width; ++c) set_child(above, c, empty_box);
}

// Nodes whose children are leaves. Their area measures how loose the tree has become.
double Bvh::refit_parents(const BodyBounds* bounds, std::size_t begin, std::size_t end) {
  double area = 0;
  static_assert(sizeof(BodyBounds) == 16 * sizeof(float) && sizeof(Aabb) == 6 * sizeof(float));
  const Lanes d;
  const hn::RebindToSigned<Lanes> indices;
  Node node;
  for (std::size_t n = begin; n < end; ++n) {
    for (std::size_t leaf = (n + nodes_ahead) * width; leaf < std::min((n + nodes_ahead + 1) * width, leaves_.size());
         ++leaf)
      prefetch_to_read(&bounds[leaves_[leaf]].fat_box);
    if ((n + 1) * width <= leaves_.size()) {
      const float* const base = &bounds->fat_box.lower.x;
      for (std::size_t c = 0; c < width; c += hn::Lanes(d)) {
        const auto leaf = hn::LoadU(indices, reinterpret_cast<const std::int32_t*>(&leaves_[n * width + c]));
        const auto at = hn::ShiftLeft<4>(leaf);
        for (int axis = 0; axis < 3; ++axis) {
          hn::Store(hn::GatherIndex(d, base, hn::Add(at, hn::Set(indices, axis))), d, node.lower[axis] + c);
          hn::Store(hn::GatherIndex(d, base, hn::Add(at, hn::Set(indices, axis + 3))), d, node.upper[axis] + c);
        }
      }
    } else {
      for (std::size_t c = 0; c < width; ++c)
        set_child(node, c, n * width + c < leaves_.size() ? bounds[leaves_[n * width + c]].fat_box : empty_box);
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

/// A box in lanes, tested against eight boxes at a time.
class Bvh::Probe {
 public:
  explicit Probe(const Aabb& box)
      : lower_{hn::Set(d, box.lower.x), hn::Set(d, box.lower.y), hn::Set(d, box.lower.z)},
        upper_{hn::Set(d, box.upper.x), hn::Set(d, box.upper.y), hn::Set(d, box.upper.z)} {}

  /// A bit for each of a node's children.
  HWY_INLINE std::uint32_t meets(const Node& node) const {
    std::uint32_t met = 0;
    for (std::size_t c = 0; c < width; c += lanes) {
      std::uint8_t bits[8] = {};
      hn::StoreMaskBits(d, meets(node.lower[0] + c, node.upper[0] + c, width), bits);
      met |= std::uint32_t{bits[0]} << c;
    }
    return met;
  }

  /// Lists which of the first `count` of eight boxes overlap, and returns the end of the list. Components of the boxes
  /// are `stride` apart. Boxes are numbered first, first + 1, …, or by `numbers`. The list needs room for eight more.
  HWY_INLINE std::uint32_t* list(const float* lower, const float* upper, std::size_t stride, std::size_t count,
                                 std::uint32_t first, std::uint32_t* end) const {
    for (std::size_t c = 0; c < width; c += lanes)
      end = append(hn::Iota(du, first + static_cast<std::uint32_t>(c)), meets(lower + c, upper + c, stride), count, c,
                   end);
    return end;
  }
  HWY_INLINE std::uint32_t* list(const float* lower, const float* upper, std::size_t stride, std::size_t count,
                                 const std::uint32_t* numbers, std::uint32_t* end) const {
    std::uint32_t last[width] = {};
    if (count < width) {
      std::copy_n(numbers, count, last);
      numbers = last;
    }
    for (std::size_t c = 0; c < width; c += lanes)
      end = append(hn::LoadU(du, numbers + c), meets(lower + c, upper + c, stride), count, c, end);
    return end;
  }

 private:
  static constexpr Lanes d{};
  static constexpr hn::Rebind<std::uint32_t, Lanes> du{};
  static constexpr std::size_t lanes = hn::MaxLanes(Lanes());

  // The indices of a number's set bits, in sequence. Highway's own compression (1.0.3) copies its table to the stack at
  // every call.
  struct BitIndices {
    std::uint8_t of[256][width];
  };
  static constexpr BitIndices bit_indices() {
    BitIndices indices{};
    for (int bits = 0; bits < 256; ++bits)
      for (std::uint8_t bit = 0, count = 0; bit < 8; ++bit)
        if (bits >> bit & 1) indices.of[bits][count++] = bit;
    return indices;
  }

  // Boxes with infinite bounds overlap the empty boxes of missing children, hence `count`.
  HWY_INLINE std::uint32_t* append(hn::Vec<decltype(du)> numbers, hn::Mask<Lanes> met, std::size_t count,
                                   std::size_t begin, std::uint32_t* end) const {
    static constexpr BitIndices table = bit_indices();
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, met, bits);
    const std::uint32_t there = count >= begin + lanes ? 255 : count > begin ? (1u << (count - begin)) - 1 : 0;
    const std::uint32_t mask = bits[0] & there;
    const auto from = hn::PromoteTo(du, hn::LoadU(hn::Rebind<std::uint8_t, Lanes>(), table.of[mask]));
    hn::StoreU(hn::TableLookupLanes(numbers, hn::IndicesFromVec(du, from)), du, end);
    return end + std::popcount(mask);
  }

  HWY_INLINE hn::Mask<Lanes> meets(const float* lower, const float* upper, std::size_t stride) const {
    const auto in = [&](std::size_t axis) {
      return hn::And(hn::Le(hn::Load(d, lower + axis * stride), upper_[axis]),
                     hn::Ge(hn::Load(d, upper + axis * stride), lower_[axis]));
    };
    return hn::And(in(0), hn::And(in(1), in(2)));
  }
  hn::Vec<Lanes> lower_[3], upper_[3];
};

// Depth first, last child first; the leaves of a node in order.
template <class Visit>
void Bvh::descend(const Aabb& box, std::uint32_t lowest, const Visit& visit) const {
  const Probe probe(box);
  struct Entry {
    std::uint32_t level, node;
  };
  Entry stack[width * 12];
  int top = 0;
  stack[top++] = {static_cast<std::uint32_t>(levels_.size() - 1), 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.level == lowest) {
      visit(probe, entry.node);
      continue;
    }
    const Node& node = nodes_[levels_[entry.level].first + entry.node];
    for (std::uint32_t mask = probe.meets(node); mask != 0; mask &= mask - 1) {
      const std::size_t child = entry.node * width + static_cast<std::size_t>(std::countr_zero(mask));
      if (has_child(entry.level, child)) stack[top++] = {entry.level - 1, static_cast<std::uint32_t>(child)};
    }
  }
}

// The number of hits is unpredictable, so they are listed without branches.
HWY_INLINE std::uint32_t* Bvh::list_leaves(const Probe& probe, std::size_t parent, std::uint32_t* end) const {
  const Node& node = nodes_[parent];
  const std::size_t first = parent * width;
  return probe.list(node.lower[0], node.upper[0], width, std::min(leaves_.size() - first, width), &leaves_[first], end);
}

void Bvh::overlap(const Aabb& box, std::vector<std::uint32_t>& found) const {
  if (leaves_.empty()) return;
  descend(box, 0, [&](const Probe& probe, std::uint32_t parent) {
    const std::size_t before = found.size();
    found.resize(before + width);
    found.resize(static_cast<std::size_t>(list_leaves(probe, parent, &found[before]) - found.data()));
  });
}

void Bvh::list_nearby(std::size_t number, Nearby& nearby) const {
  nearby.count = 0;
  nearby.is_known = levels_.size() > 2;
  if (!nearby.is_known) return;
  std::size_t count = 0;
  descend(box_of(nodes_[levels_[1].first + number]), 1, [&](const auto&, std::uint32_t node) {
    if (count < Nearby::most) {
      const Node& parent = nodes_[levels_[2].first + node / width];
      for (int axis = 0; axis < 3; ++axis) {
        nearby.lower[axis][count] = parent.lower[axis][node % width];
        nearby.upper[axis][count] = parent.upper[axis][node % width];
      }
      nearby.nodes[count] = node;
    }
    ++count;
  });
  nearby.is_known = count <= Nearby::most;
  if (!nearby.is_known) return;
  nearby.count = count;
  for (; count % width != 0; ++count)
    for (int axis = 0; axis < 3; ++axis) nearby.lower[axis][count] = infinity, nearby.upper[axis][count] = -infinity;
}

void Bvh::overlap(const Aabb& box, const Nearby& nearby, std::vector<std::uint32_t>& found) const {
  if (!nearby.is_known) return overlap(box, found);
  const Probe probe(box);
  // Level by level. Lists are read backwards, so that parents come in the order of `descend`.
  std::uint32_t near[Nearby::most + width], parents[(Nearby::most + 1) * width];
  std::uint32_t* near_end = near;
  for (std::size_t first = 0; first < nearby.count; first += width)
    near_end = probe.list(nearby.lower[0] + first, nearby.upper[0] + first, Nearby::most, nearby.count - first,
                          nearby.nodes + first, near_end);
  std::uint32_t* parents_end = parents;
  while (near_end != near) {
    const std::uint32_t number = *--near_end, first = number * width;
    const Node& node = nodes_[levels_[1].first + number];
    parents_end = probe.list(node.lower[0], node.upper[0], width, levels_[0].count - first, first, parents_end);
  }
  const std::size_t before = found.size();
  found.resize(before + static_cast<std::size_t>(parents_end - parents) * width + width);
  std::uint32_t* end = &found[before];
  while (parents_end != parents) end = list_leaves(probe, *--parents_end, end);
  found.resize(static_cast<std::size_t>(end - found.data()));
}

std::size_t Bvh::memory_bytes() const {
  return leaves_.capacity() * sizeof(std::uint32_t) + nodes_.capacity() * sizeof(Node) +
         (keys_.capacity() + sorted_.capacity()) * sizeof(Key);
}

}  // namespace fathom::native
