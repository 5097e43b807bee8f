// State of a mechanism's link during a step. Included like dynamics/joint_link-inl.hpp.

/// Only words as long as a Real, because lanes are separated word by word. First what the step begins with; solutions
/// set the rest.
struct LinkState {
  BallJointRow<Real> row;  ///< of a ball joint; A: the parent, B: the body; impulses on B
  Real mass;               ///< kg, the link's share
  SymMat3 inertia;         ///< kg·m², also its share, in the body's axes
  UnitQuat<Real> start;    ///< the body's orientation at the start of the step
  Flag is_isotropic;       ///< same in all lanes
  LinkMotion obstacle;     ///< of what the link hangs on; a copy, since other threads may already have moved it
  Vec3 arm, parent_arm;    ///< m, current
  Vec3 moment,
      parent_moment;    ///< N·m·s of the joint so far, in the axes of the body's spin and, reversed, of its parent's
  UnitQuat<Real> spin;  ///< from the axes of the body's spin to the world's
  LinkMotion motion;
  TreeInertia of_body;
  TreeLink link;
  Flag is_eliminated;       ///< the elimination in `link`, or in the JointLink, is up to date
  Flag is_changed;          ///< by the last pass
  TreeLoad load, handed;    ///< on the body, and what its parent gets at the joint
  Vec3 error;               ///< m/s
  Real closing;             ///< m/s, the fastest with which a gap closes in this substep
  TreeChange step, change;  ///< of a round, and of all rounds
  Vec3 impulse;             ///< N·s, of all rounds
  Vec3 dropped;             ///< N·s, of the last substep, that a projection starts without
};

/// What a link needs while its mechanism sweeps over contacts (dynamics/link_contact.hpp).
struct LinkPushes {
  /// Change of the body's velocity per impulse, and per moment, along the axes of the spin, in which its angular part
  /// is, too.
  TreeChange by_impulse[3], by_moment[3];
  TreeLoad load;  ///< of the link's own contacts
};
