// Any point cloud as a hull: refused with one `Error`, or a closed polyhedron with a volume.
#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fathom;
  fuzz::Input input(data, size);
  std::vector<Vec3> points;
  while (!input.empty() && points.size() < 400) points.push_back(input.vector());
  try {
    const Shape shape = hull(points);
    const Hull& h = *shape.hull;
    fuzz::require(h.volume() > 0 && is_finite(h.volume()) && is_finite(h.outer_radius()));
    fuzz::require(h.inner_radius() <= h.outer_radius());
    fuzz::require(static_cast<int>(h.vertices().size() + h.planes().size()) ==
                  static_cast<int>(h.edges().size() / 2) + 2);
    for (const Hull::HalfEdge& edge : h.edges())
      fuzz::require(edge.next < h.edges().size() && edge.origin < h.vertices().size() && edge.face < h.planes().size());
    const MassProperties mass = mass_properties(shape, 1.0f);
    fuzz::require(mass.principal_moments.x > 0 && is_finite(mass.principal_moments));
  } catch (const Error&) {
  }
  return 0;
}
