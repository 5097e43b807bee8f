// Bounds on separations from some points of a hull, which leave few faces and edges to try.
//
// Along no axis is a hull higher than any of its points, its *witnesses*. Over a face that is the witness' height h. The
// axis n across two edges is a combination α·l + β·r of the normals beside either of them, with α, β ≥ 0, and
// α + β ≥ 1 because it is of unit length; so along it the witness is α·h_l + β·h_r over that edge, and where both
// heights are less than some t ≤ 0, so is the separation.
#pragma once

#include "collision/frame.hpp"
#include "collision/support.hpp"

namespace fathom {

inline constexpr float no_separation = -3e38f;
inline constexpr int most_faces = 255, most_edges = 512;  ///< of a hull; undirected edges

struct FaceAxis {
  int face = 0;
  float separation = no_separation;
};

/// What rounding, and merging faces, may make of a height that is at most `reach` (m).
FATHOM_HD float height_slack(float reach) { return 5e-6f * reach; }

/// The last points found.
struct Witnesses {
  static constexpr int most = 6;
  Vec3 points[most];
  int found = 0;

  FATHOM_HD void add(Vec3 point) { points[found++ % most] = point; }
  FATHOM_HD int count() const { return found < most ? found : most; }
};

/// For each face of a hull the least height of the witnesses over it.
struct FaceHeights {
  alignas(32) float heights[most_faces + 1];

  FATHOM_HD explicit FaceHeights(const HullView& hull) {
    for (int f = 0; f < hull.face_count; f += 8)
      for (int i = 0; i < 8; ++i) heights[f + i] = f + i < hull.face_count ? -no_separation : no_separation;
  }

  /// Takes a face out.
  FATHOM_HD void close(int face) { heights[face] = no_separation; }

  /// Another witness. Returns the highest face then, the first of equals; none has `no_separation`.
  FATHOM_HD FaceAxis lower(const HullView& hull, Vec3 witness) {
#if defined(FATHOM_HAS_EIGHT)
    if (hull.plane_eights) return lower_eights(hull, witness);
#endif
    FaceAxis highest;
    for (int f = 0; f < hull.face_count; ++f) {
      heights[f] = min(heights[f], plane_height(hull.planes[f], witness));
      if (heights[f] > highest.separation) highest = {f, heights[f]};
    }
    return highest;
  }

 private:
#if defined(FATHOM_HAS_EIGHT)
  FaceAxis lower_eights(const HullView& hull, Vec3 witness) {
    const EightVec3 point = eight(witness);
    const EightInts count{0, 1, 2, 3, 4, 5, 6, 7};
    Eight highest = eight(no_separation);
    EightInts face = count;
    for (int f = 0; f < hull.face_count; f += 8) {
      const Hull::Eight& planes = hull.plane_eights[f / 8];
      Eight& bounds = reinterpret_cast<Eight&>(heights[f]);
      bounds = min(bounds, dot(vectors(planes), point) - eight(planes.w));
      const EightInts higher = bounds > highest;
      highest = higher ? bounds : highest;
      face = higher ? count + f : face;
    }
    const LeastLane least = least_lane(-highest, face);
    return {least.index, -least.value};
  }
#endif
};

/// Which of some points see which faces.
struct SeenFaces {
  alignas(8) std::uint8_t by[most_faces + 1];  ///< bit i: point i is not lower over this face than asked
  unsigned all;                                ///< a bit for each point
  std::uint8_t faces[most_faces];              ///< those that some point sees, ascending; without points all of them
  int count = 0;

  /// `low` (m): height over a face from which on a point sees it.
  FATHOM_HD SeenFaces(const HullView& hull, const Witnesses& points, float low) : all((1u << points.count()) - 1) {
#if defined(FATHOM_HAS_EIGHT)
    if (hull.plane_eights && all != 0) {
      mark_eights(hull, points, low);
      return;
    }
#endif
    for (int f = 0; f < hull.face_count; ++f) {
      unsigned seen = 0;
      for (int i = 0; i < points.count(); ++i)
        seen |= (plane_height(hull.planes[f], points.points[i]) < low ? 0u : 1u) << i;
      by[f] = static_cast<std::uint8_t>(seen);
      if (seen != 0 || all == 0) faces[count++] = static_cast<std::uint8_t>(f);
    }
  }

  FATHOM_HD bool lists(int face) const { return by[face] != 0 || all == 0; }

 private:
#if defined(FATHOM_HAS_EIGHT)
  void mark_eights(const HullView& hull, const Witnesses& points, float low) {
    const int number = points.count();
    const EightInts lane{0, 1, 2, 3, 4, 5, 6, 7};
    for (int f = 0; f < hull.face_count; f += 8) {
      const Hull::Eight& planes = hull.plane_eights[f / 8];
      EightInts seen = eight(0);
      for (int i = 0; i < number; ++i) {
        const Eight height = dot(vectors(planes), eight(points.points[i])) - eight(planes.w);
        seen |= ~(height < eight(low)) & eight(1 << i);
      }
      for (int i = 0; i < 8; ++i) by[f + i] = 0;
      for (unsigned left = bits((seen != 0) & (lane < hull.face_count - f)); left != 0; left &= left - 1) {
        const int i = std::countr_zero(left);
        by[f + i] = static_cast<std::uint8_t>(seen[i]);
        faces[count++] = static_cast<std::uint8_t>(f + i);
      }
    }
  }
#endif
};

/// Undirected edges of a hull along which no axis is known to separate less than `threshold` (m).
struct NearEdges {
  std::uint16_t edges[most_edges];
  int count = 0;

  /// `witnesses` of the other shape, in this hull's frame; `slack`: see `height_slack`.
  FATHOM_HD NearEdges(const HullView& hull, const Witnesses& witnesses, float threshold, float slack) {
    const SeenFaces seen(hull, witnesses, min(threshold, 0.0f) - slack);
    for (int i = 0; i < seen.count; ++i) {
      const int face = seen.faces[i];
      int e = hull.face_edges[face];
      do {
        const int beyond = hull.edges[e ^ 1].face;
        const bool is_others = e % 2 == 1 && seen.lists(beyond);
        if ((seen.by[face] | seen.by[beyond]) == seen.all && !is_others) edges[count++] = static_cast<std::uint16_t>(e >> 1);
        e = hull.edges[e].next;
      } while (e != hull.face_edges[face]);
    }
  }
};

}  // namespace fathom
