#include <algorithm>
#include <fathom/shape.hpp>

namespace fathom {
namespace {

template <class Item, class Put>
std::vector<Hull::Eight> by_eights(const std::vector<Item>& items, Put put) {
  std::vector<Hull::Eight> eights((items.size() + 7) / 8);
  for (std::size_t i = 0; i < 8 * eights.size(); ++i) put(eights[i / 8], i % 8, items[i < items.size() ? i : 0]);
  return eights;
}

}  // namespace

void Hull::arrange() {
  const auto put = [](Eight& eight, std::size_t lane, Vec3 v, float w) {
    eight.x[lane] = v.x, eight.y[lane] = v.y, eight.z[lane] = v.z, eight.w[lane] = w;
  };
  vertex_eights_ = by_eights(vertices_, [&](Eight& to, std::size_t lane, Vec3 v) { put(to, lane, v, 0); });
  plane_eights_ =
      by_eights(planes_, [&](Eight& to, std::size_t lane, const Plane& p) { put(to, lane, p.normal, p.offset); });

  vertex_edges_.assign(vertices_.size(), 0);
  for (std::size_t e = edges_.size(); e-- > 0;) vertex_edges_[edges_[e].origin] = static_cast<std::uint16_t>(e);
  largest_coordinate_ = 0;
  for (const Vec3& v : vertices_) largest_coordinate_ = std::max(largest_coordinate_, max_component(abs(v)));
}

}  // namespace fathom
