// A contact as the application sees it before it is solved (PreSolveContact), and its answer. The application sees the
// lower slot first, the simulators A.
#pragma once

#include "native/pieces.hpp"
#include "world/body_table.hpp"
#include "world/callbacks.hpp"

namespace fathom::native {

struct AskedContact {
  std::uint32_t a, b;  ///< slots
  Children children;

  bool swaps() const { return b < a; }
};

/// `normal`: from A to B. Without points.
inline PreSolveContact question_about(const AskedContact& asked, const BodyTable& bodies, Vec3 normal,
                                      const ContactMaterials& mixed) {
  const bool swaps = asked.swaps();
  PreSolveContact contact{};
  contact.a = bodies.id(swaps ? asked.b : asked.a), contact.b = bodies.id(swaps ? asked.a : asked.b);
  contact.child_a = swaps ? asked.children.b : asked.children.a;
  contact.child_b = swaps ? asked.children.a : asked.children.b;
  contact.normal = swaps ? -normal : normal;
  contact.friction = mixed.friction, contact.restitution = mixed.restitution;
  contact.surface_velocity = swaps ? -mixed.slide : mixed.slide;
  return contact;
}

inline ContactMaterials materials_of(const AskedContact& asked, const PreSolveContact& answer) {
  const Vec3 slide = answer.surface_velocity;
  return {answer.friction, answer.restitution, asked.swaps() ? -slide : slide};
}

}  // namespace fathom::native
