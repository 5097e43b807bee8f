// Bounds on separations from some points of a hull, which leave only a few faces and edges to try.
//
// A hull is at least as low along any axis as each of its points, its *witnesses*. Over a face this bound is the
// witness' height h. The axis n across two edges is a combination α·l + β·r of the normals beside either edge, with α,
// β ≥ 0, and α + β ≥ 1 because it has unit length. Along n the witness is therefore at α·h_l + β·h_r over that edge,
// and where both heights are below some t ≤ 0, so is the separation.
#pragma once

#include "collision/frame.hpp"
#include "collision/support.hpp"

namespace fathom {

inline constexpr float no_separation = -3e38f;
inline constexpr int max_faces = 255, max_edges = 512;  ///< of a hull; edges are undirected

struct FaceAxis {
  int face = 0;
  float separation = no_separation;
};

/// Error of a height of at most `reach` (m), due to rounding and merged faces.
FATHOM_HD float height_slack(float reach) { return 5e-6f * reach; }

/// The points found last.
struct Witnesses {
  static constexpr int most = 6;
  Vec3 points[most];
  int found = 0;

  FATHOM_HD void add(Vec3 point) { points[found++ % most] = point; }
  FATHOM_HD int count() const { return found < most ? found : most; }
};

/// For each face of a hull, the lowest height of the witnesses over it.
struct FaceHeights {
  alignas(32) float heights[max_faces + 1];

  FATHOM_HD explicit FaceHeights(const HullView& hull) {
#if defined(FATHOM_HAS_EIGHT)
    if (by_eights(hull)) {
      for (int f = 0; f < hull.face_count; f += 8)
        eight_at(heights, f) =
            select(lane_numbers() + (f - hull.face_count) < eight(0), eight(-no_separation), eight(no_separation));
      return;
    }
#endif
    for (int f = 0; f < hull.face_count; f += 8)
      for (int i = 0; i < 8; ++i) heights[f + i] = f + i < hull.face_count ? -no_separation : no_separation;
  }

  /// Excludes a face.
  FATHOM_HD void close(const HullView& hull, int face) {
#if defined(FATHOM_HAS_EIGHT)
    if (by_eights(hull)) {
      set_number(heights, face, no_separation);
      return;
    }
#endif
    heights[face] = no_separation;
  }

  /// Adds a witness. Returns the face that now has the greatest height, the first of equals; without any face, its
  /// separation is `no_separation`.
  FATHOM_HD FaceAxis lower(const HullView& hull, Vec3 witness) {
#if defined(FATHOM_HAS_EIGHT)
    if (by_eights(hull)) return lower_eights(hull, witness);
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
  FATHOM_HD FaceAxis lower_eights(const HullView& hull, Vec3 witness) {
    const EightVec3 point = eight(witness);
    const EightInts count = lane_numbers();
    Eight highest = eight(no_separation);
    EightInts face = count;
    for (int f = 0; f < hull.face_count; f += 8) {
      Eight& bounds = eight_at(heights, f);
      bounds = min(bounds, plane_height(planes_at(hull, f), point));
      const EightInts higher = bounds > highest;
      highest = select(higher, bounds, highest);
      face = select(higher, count + f, face);
    }
    const LeastLane least = min_lane(-highest, face);
    return {least.index, -least.value};
  }
#endif
};

/// Which of some points see which faces.
struct SeenFaces {
  alignas(8) std::uint8_t by[max_faces + 1];  ///< bit i: point i is at least at the required height over this face
  std::uint8_t faces[max_faces];              ///< those that some point sees, ascending
  int count = 0;

  /// `low` (m): minimum height over a face at which a point sees it.
  FATHOM_HD SeenFaces(const HullView& hull, const Witnesses& points, float low) {
#if defined(FATHOM_HAS_EIGHT)
    if (by_eights(hull)) {
      mark_eights(hull, points, low);
      return;
    }
#endif
    for (int f = 0; f < hull.face_count; ++f) {
      unsigned by_whom = 0;
      for (int i = 0; i < points.count(); ++i) {
        by_whom |= (plane_height(hull.planes[f], points.points[i]) < low ? 0u : 1u) << i;
      }
      by[f] = static_cast<std::uint8_t>(by_whom);
      faces[count] = static_cast<std::uint8_t>(f);
      count += by_whom != 0 ? 1 : 0;
    }
  }

 private:
#if defined(FATHOM_HAS_EIGHT)
  FATHOM_HD void mark_eights(const HullView& hull, const Witnesses& points, float low) {
    const int number = points.count();
    for (int f = 0; f < hull.face_count; f += 8) {
      const EightPlanes planes = planes_at(hull, f);
      const unsigned lanes = 0xffu >> (f + 8 > hull.face_count ? f + 8 - hull.face_count : 0);
      unsigned any = 0, sees[Witnesses::most];
      for (int i = 0; i < number; ++i) {
        sees[i] = ~bits(plane_height(planes, eight(points.points[i])) < eight(low)) & lanes;
        any |= sees[i];
      }
      for (int i = 0; i < 8; ++i) by[f + i] = 0;
      for (; any != 0; any &= any - 1) {
        const int lane = lowest_bit(any);
        unsigned by_whom = 0;
        for (int i = 0; i < number; ++i) by_whom |= (sees[i] >> lane & 1) << i;
        by[f + lane] = static_cast<std::uint8_t>(by_whom);
        faces[count++] = static_cast<std::uint8_t>(f + lane);
      }
    }
  }
#endif
};

/// Undirected edges of a hull whose axes may separate by `threshold` (m) or more.
struct NearEdges {
  std::uint16_t edges[max_edges + 1];  // an entry is written before it is known to count
  int count = 0;

  /// `witnesses`: at least one point of the other shape, in this hull's frame; `slack`: see `height_slack`.
  FATHOM_HD NearEdges(const HullView& hull, const Witnesses& witnesses, float threshold, float slack) {
    const SeenFaces faces(hull, witnesses, min(threshold, 0.0f) - slack);
    // Every witness sees a face beside a near edge.
    const int all = (1 << witnesses.count()) - 1;
    for (int k = 0; 2 * k < hull.edge_count; ++k) {
      edges[count] = static_cast<std::uint16_t>(k);
      count += (faces.by[hull.edges[2 * k].face] | faces.by[hull.edges[2 * k + 1].face]) == all ? 1 : 0;
    }
  }
};

}  // namespace fathom
