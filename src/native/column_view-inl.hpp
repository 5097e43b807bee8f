// A column's contacts and bodies, read and written in the blocks' lanes.
// Included once per instruction set by solver_kernels.cpp (Highway's foreach_target).

#if defined(FATHOM_COLUMN_VIEW_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef FATHOM_COLUMN_VIEW_INL
#undef FATHOM_COLUMN_VIEW_INL
#else
#define FATHOM_COLUMN_VIEW_INL
#endif

#include "dynamics/columns.hpp"
#include "native/constraint_block-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace fathom::native::HWY_NAMESPACE {

template <class D>
struct ColumnView {
  BlockArray blocks;
  const ColumnContact* contacts;
  const BodiesView& view;
  const SweepParameters& parameters;

  HWY_INLINE Block<D> block(std::uint32_t k) const { return block_at<D>(blocks, contacts[k].lane / Block<D>::width); }
  /// Component `field` of contact k.
  HWY_INLINE float& at(const Block<D>& block, std::uint32_t k, int field) const {
    return block.at(field)[contacts[k].lane % Block<D>::width];
  }
  HWY_INLINE float& point(const Block<D>& block, std::uint32_t k, int i, PointField field) const {
    return at(block, k, Block<D>::point(i, field));
  }
  HWY_INLINE Vec3 vector(const Block<D>& block, std::uint32_t k, int field) const {
    return {at(block, k, field), at(block, k, field + 1), at(block, k, field + 2)};
  }

  void load(std::uint32_t k, ColumnContactState& s) const {
    const Block<D> from = block(k);
    s.frame.normal = vector(from, k, normal_x);
    s.frame.tangent = vector(from, k, tangent_x);
    s.frame.arm_a = vector(from, k, arm_a_x);
    s.frame.arm_b = vector(from, k, arm_b_x);
    s.frame.friction = at(from, k, friction);
    s.frame.patch_radius = at(from, k, patch_radius);
    s.count = 0;
    for (int i = 0; i < from.header().max_points; ++i) {
      // Points that the lane does not have weigh nothing.
      const float mass = point(from, k, i, point_mass);
      if (!(mass > 0)) break;
      s.points[i] = {point(from, k, i, point_x), point(from, k, i, point_y), point(from, k, i, point_separation), mass};
      s.impulses.normal[i] = point(from, k, i, point_impulse);
      ++s.count;
    }
    s.impulses.slide_1 = at(from, k, friction_impulse_1);
    s.impulses.slide_2 = at(from, k, friction_impulse_2);
    s.impulses.twist = at(from, k, twist_impulse);
    s.impulses.step = at(from, k, step_impulse);
    s.up = contacts[k].upward ? 1.0f : -1.0f;
  }
  void set_impulses(std::uint32_t k, const ContactImpulses& p) const {
    const Block<D> to = block(k);
    for (int i = 0; i < to.header().max_points; ++i) point(to, k, i, point_impulse) = p.normal[i];
    at(to, k, friction_impulse_1) = p.slide_1;
    at(to, k, friction_impulse_2) = p.slide_2;
    at(to, k, twist_impulse) = p.twist;
    at(to, k, step_impulse) = p.step;
  }
  ContactStep step(std::uint32_t k) const {
    const bool fixed = body(k).inverse_mass == 0;
    return {parameters.inverse_substep, fixed ? parameters.contacts.fixed : parameters.contacts.dynamic,
            parameters.push_out_velocity, false};
  }

  std::uint32_t slot(std::uint32_t j) const { return j == 0 ? contacts[0].below : contacts[j - 1].above; }
  const SolverBody& body(std::uint32_t j) const { return view.bodies[slot(j)]; }
  Vec3 acceleration(std::uint32_t j) const { return view.motion[slot(j)].acceleration; }
  Mat3 inertia(std::uint32_t j, float inverse) const {
    const WorldInertia& w = view.inertias[slot(j)];
    return column_inertia(inverse, SymMat3{w.xx, w.yy, w.zz, w.xy, w.xz, w.yz});
  }
  void set_velocity(std::uint32_t j, Vec3 linear, Vec3 angular) const {
    view.bodies[slot(j)].linear = linear;
    view.bodies[slot(j)].angular = angular;
  }
};

template <class D>
void brace(BlockArray blocks, const ColumnContact* column, std::uint32_t contacts, const BodiesView& view,
           bool pushes_out, const SweepParameters& p) {
  const ColumnView<D> c{blocks, column, view, p};
  ColumnBrace<ColumnView<D>>(c, contacts, pushes_out)();
}

}  // namespace fathom::native::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
