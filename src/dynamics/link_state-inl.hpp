// What a link of a mechanism is in a step. Included as dynamics/joint_link-inl.hpp is.

/// Words alone, each as long as a Real: lanes are taken apart word by word.
struct LinkState {
  BallJointRow<Real> row;  ///< of a ball joint; A: the parent, B: the body; impulses on B
  Real mass;               ///< kg, the link's share
  SymMat3 inertia;         ///< kg·m², likewise, in the body's axes
  UnitQuat<Real> start;    ///< the body's orientation as the step began
  Flag is_isotropic;       ///< alike in all lanes
  UnitQuat<Real> spin;     ///< from the axes in which the body's spin is written to the world's
  LinkMotion motion;
  LinkMotion obstacle;         ///< of what the link hangs on, which other threads may have moved on or not
  Vec3 arm, parent_arm;        ///< m, now
  Vec3 moment, parent_moment;  ///< N·m·s that the joint has given so far, as the body and, reversed, its parent spin
  TreeInertia of_body;
  TreeLink link;
  Flag is_eliminated;       ///< the elimination in `link`, or in the JointLink, is up to date
  Flag is_changed;          ///< the last pass has made it so
  TreeLoad load, handed;    ///< on the body, and what its parent gets of it at the joint
  Vec3 error;               ///< m/s
  TreeChange step, change;  ///< of a round, and of all of them
  Vec3 impulse;             ///< N·s, of all rounds
};
