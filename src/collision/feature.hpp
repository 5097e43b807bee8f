// Feature ids: which features of A and B form a contact point.
//
// An id names the features that meet (vertex on face, edge on edge), not the face that happened to be the reference, so
// a point keeps its id, and with it its warm-started impulse, when the reference changes to the other shape.
#pragma once

#include <cstdint>
#include <fathom/math.hpp>

namespace fathom {

enum class FeatureKind : std::uint32_t { round = 0, vertex_of_a = 1, vertex_of_b = 2, edges = 3 };

FATHOM_HD std::uint32_t make_feature(FeatureKind kind, std::uint32_t a, std::uint32_t b) {
  return (static_cast<std::uint32_t>(kind) << 30) | (a << 15) | b;
}

/// A vertex of either shape lies on a face of the other.
FATHOM_HD std::uint32_t vertex_feature(std::uint32_t vertex, bool of_b) {
  return of_b ? make_feature(FeatureKind::vertex_of_b, 0, vertex) : make_feature(FeatureKind::vertex_of_a, vertex, 0);
}

/// Two undirected edges cross; `flipped`: the reference shape is B.
FATHOM_HD std::uint32_t edge_feature(std::uint32_t reference, std::uint32_t incident, bool flipped) {
  return flipped ? make_feature(FeatureKind::edges, incident, reference)
                 : make_feature(FeatureKind::edges, reference, incident);
}

/// The same feature with the shapes swapped.
FATHOM_HD std::uint32_t swap_feature(std::uint32_t feature) {
  const std::uint32_t a = (feature >> 15) & 0x7fff, b = feature & 0x7fff;
  const std::uint32_t kind = feature >> 30, on_vertex = kind == 1 || kind == 2 ? 3 - kind : kind;
  return make_feature(static_cast<FeatureKind>(on_vertex), b, a);
}

}  // namespace fathom
