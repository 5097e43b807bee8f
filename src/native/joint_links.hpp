// Generic and distance joints as links of a mechanism: which of their coordinates are held, driven or free in a
// substep, and what they give. A link is a body and the joint to its parent. Its coordinates are of the body against
// the parent (dynamics/joint_elimination.hpp), a joint's axes those of B against A (dynamics/generic_joint-inl.hpp).
#pragma once

#include <cstdint>

#include "dynamics/generic_joint.hpp"
#include "dynamics/joint_elimination.hpp"
#include "dynamics/rotation.hpp"

namespace fathom::native {

/// How a body moves, in world axes.
struct LinkMotion {
  Vec3 moved, turned;    ///< m and rad, since the step began
  Vec3 linear, angular;  ///< m/s and rad/s
  bool is_isotropic = true;

  /// Rad since the step began, when a substep of length h (s) will be over: rotation vectors of isotropic bodies are
  /// summed up, of others they are what they are (`turned_so_far`).
  Vec3 turned_ahead(float h) const {
    return is_isotropic ? mul_add(turned, h, angular) : turned_further(turned, h * angular);
  }
};

/// A joint's two bodies by their part in the tree.
struct LinkPair {
  const LinkMotion &body, &parent;
};

class JointLink {
 public:
  /// As the step begins. Of `row` frames, arms, gap, pull and rates are set; `is_b`: the link's body is the joint's B.
  void begin(const GenericJoint& joint, bool is_b, const GenericJointRow<float>& row, const GenericImpulse& impulse);
  /// On the body at the joint, in this substep: N·s and N·m·s.
  Vec3 force() const { return force_; }
  Vec3 torque() const { return torque_; }
  /// m, from the centres of the body and of the parent to where the joint acts.
  Vec3 arm() const { return is_b_ ? arm_b_ : reach_a_; }
  Vec3 parent_arm() const { return is_b_ ? reach_a_ : arm_b_; }
  /// All rotations are held.
  bool is_stiff() const { return (freedom_.is_free >> 3) == 0; }
  void forget();

  /// Where the joint is, as a solution begins. `relaxes`: after positions have moved, without drives.
  void look(const JointBodies<SymMat3>& bodies, float h, bool relaxes);
  /// Chooses coordinates by what is held, and what drives give by now.
  void choose_coordinates(const LinkPair& pair);
  void eliminate(const TreeInertia& body, TreeInertia* parent);
  /// Errors of a round (m/s and rad/s), so that what is held comes to where it is to be within h …
  void aim_ahead(const LinkPair& pair, float h);
  /// … or loses its velocity and this share of its gap, at `most` at the fastest.
  void aim_at_rest(const LinkPair& pair, float gap_share, float most, float h);
  /// What the parent gets of the body's load, both about the joint.
  TreeLoad hand_on(const TreeLoad& load);
  /// The body's change where its parent changes thus; the joint gives what that takes.
  TreeChange follow(const TreeChange& parent);

  /// Takes on or lets go limits and largest forces where the rounds' result says otherwise. True where that changes it.
  bool revise(const LinkPair& pair, float h);
  /// Whether what is held will be within `share` of where it is to be: of arms, or rad.
  bool meets(const LinkPair& pair, float h, float share) const;
  void take_back() { force_more_ = torque_more_ = {}, is_first_round_ = true; }
  Vec3 force_more() const { return force_more_; }
  Vec3 torque_more() const { return torque_more_; }
  /// The rounds' impulses count; `ends`: the substep is over.
  void apply(const LinkPair& pair, bool ends);
  GenericImpulse impulse() const;

 private:
  static constexpr int no_axis = -1;

  float sign() const { return is_b_ ? 1.0f : -1.0f; }
  const GenericAxis<float>& axis(int i) const { return joint_->axes[i]; }
  bool is_at_limit(int i) const { return at_limit_ >> i & 1u; }
  bool is_at_most(int i) const { return at_most_ >> i & 1u; }
  bool is_driven(int i) const { return !relaxes_ && axis(i).most > 0; }
  float compliance(int i) const { return fma(axis(i).response, mass_[i], axis(i).compliance); }
  /// A drive that gives whatever its velocity takes.
  bool is_rigid_drive(int i) const { return is_driven(i) && !is_at_most(i) && !(compliance(i) > 0); }
  bool is_held(int i) const { return axis(i).locked != 0 || is_at_limit(i) || is_rigid_drive(i); }
  float drive_aim(int i) const;
  /// What the armature gives of N·s or N·m·s where the axis gets the rate `to`.
  float of_armature(int i, float to) const { return axis(i).armature * (rate_[i] - to); }
  void resist(int k, const LinkPair& pair);
  void note_hit(int i);
  /// Where what is held is to be at the substep's end.
  float wanted_value(int i, float h) const;
  float rate(int i, const LinkPair& pair) const;
  void values_ahead(const LinkPair& pair, float h, JointVector& values) const;
  void add_rotation(int i, int& count, bool is_free);
  void set_errors(const JointVector& of_axes);
  /// N·s or N·m·s on B, of the substep so far and the rounds.
  float impulse_of(int k) const;
  bool revise_limit(int i, float ahead, float given, float after);
  bool revise_drive(int i, float given, float after);

  const GenericJoint* joint_ = nullptr;
  bool is_b_ = true, relaxes_ = false, is_first_round_ = true;
  GenericJointRow<float> row_{};
  Vec3 along_[3], about_[3];  // of axes, now
  JointVector value_{}, mass_{};
  Vec3 reach_a_, arm_b_;
  JointFreedom freedom_;
  int axis_of_[joint_coordinates] = {};  // of a coordinate, or no_axis
  JointVector scale_{};                  // the axis' rate of a coordinate's
  JointVector drive_{}, error_{};
  EliminatedLink link_{};
  JointLoad load_{};
  JointVector rate_{}, bounce_{};              // m/s or rad/s: as the last solution left it, and limits throw it back
  std::uint32_t at_limit_ = 0, at_upper_ = 0;  // by axis
  std::uint32_t at_most_ = 0, at_minus_ = 0;   // drives that give the most, forwards or backwards
  Vec3 force_, torque_, force_more_, torque_more_, force_sum_, torque_sum_;
};

}  // namespace fathom::native
