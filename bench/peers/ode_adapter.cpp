// ODE: dWorldQuickStep with 20 iterations, hash space, up to 8 contacts per pair as in its box stacks.
#include <ode/ode.h>

#include <cmath>
#include <mutex>

#include "engine.hpp"

namespace fathom::peers {
namespace {

constexpr int max_contacts = 8;

Vec3 vector(const dReal* v) { return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}; }
Quat quaternion(const dReal* q) {
  return {static_cast<float>(q[0]), static_cast<float>(q[1]), static_cast<float>(q[2]), static_cast<float>(q[3])};
}

dReal real(float value) { return static_cast<dReal>(value); }

class OdeEngine final : public Engine {
 public:
  OdeEngine(const Scene& scene, int threads) : dt_(real(scene.world.dt)) {
    static std::once_flag once;
    std::call_once(once, [] { dInitODE2(0); });
    dAllocateODEDataForThread(dAllocateMaskAll);
    world_ = dWorldCreate();
    space_ = dHashSpaceCreate(nullptr);
    joints_ = dJointGroupCreate(0);
    const Vec3 g = scene.world.gravity;
    dWorldSetGravity(world_, real(g.x), real(g.y), real(g.z));
    if (threads > 1) use_threads(static_cast<unsigned>(threads));
    for (const BodyDef& body : scene.bodies) add(body);
    require_plain_joints("ODE", scene);
    for (const SceneJoint& joint : scene.joints) add(joint);
  }

  ~OdeEngine() override {
    if (pool_) {
      dThreadingImplementationShutdownProcessing(threading_);
      dThreadingFreeThreadPool(pool_);
      dWorldSetStepThreadingImplementation(world_, nullptr, nullptr);
      dThreadingFreeImplementation(threading_);
    }
    dJointGroupDestroy(joints_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }

  void step() override {
    dSpaceCollide(space_, this, &OdeEngine::meet);
    dWorldQuickStep(world_, dt_);
    dJointGroupEmpty(joints_);
  }

  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Item& item = bodies_[i];
      if (!item.body) {
        poses[i] = item.start;
        velocities[i] = {};
        continue;
      }
      poses[i] = {vector(dBodyGetPosition(item.body)), 0, quaternion(dBodyGetQuaternion(item.body))};
      velocities[i] = {vector(dBodyGetLinearVel(item.body)), 0, vector(dBodyGetAngularVel(item.body)), 0};
    }
  }

  void set_velocity(std::size_t body, const Velocity& v) override {
    dBodySetLinearVel(bodies_[body].body, real(v.linear.x), real(v.linear.y), real(v.linear.z));
    dBodySetAngularVel(bodies_[body].body, real(v.angular.x), real(v.angular.y), real(v.angular.z));
  }

 private:
  struct Item {
    dBodyID body = nullptr;  // null if it does not move
    Pose start;
    float friction = 0;
  };

  /// Its own pool; only the solver uses it.
  void use_threads(unsigned threads) {
    threading_ = dThreadingAllocateMultiThreadedImplementation();
    if (!threading_) throw Error(ErrorCode::unavailable, "this ODE was built without threads");
    pool_ = dThreadingAllocateThreadPool(threads, 0, dAllocateFlagBasicData, nullptr);
    dThreadingThreadPoolServeMultiThreadedImplementation(pool_, threading_);
    dWorldSetStepThreadingImplementation(world_, dThreadingImplementationGetFunctions(threading_), threading_);
    dWorldSetStepIslandsProcessingMaxThreadCount(world_, threads);
  }

  dGeomID geom_of(const Shape& shape, float total, dMass& mass) {
    const dReal radius = real(shape.radius), kg = real(total);
    const Vec3 size = 2 * shape.half_extents;
    switch (shape.type) {
      case ShapeType::sphere:
        dMassSetSphereTotal(&mass, kg, radius);
        return dCreateSphere(space_, radius);
      case ShapeType::capsule:
        dMassSetCapsuleTotal(&mass, kg, 3, radius, real(size.z));
        return dCreateCapsule(space_, radius, real(size.z));
      case ShapeType::box:
        dMassSetBoxTotal(&mass, kg, real(size.x), real(size.y), real(size.z));
        return dCreateBox(space_, real(size.x), real(size.y), real(size.z));
      case ShapeType::mesh:
      case ShapeType::height_field:
      case ShapeType::compound:
        refuse_shape("ODE");
      case ShapeType::hull:
        break;
    }
    refuse_scene("ODE", "hulls, between which it finds no contacts");
  }

  void add(const BodyDef& def) {
    const Vec3 p = def.pose.position;
    const Quat r = def.pose.rotation;
    const dQuaternion q = {real(r.w), real(r.x), real(r.y), real(r.z)};
    dMass mass;
    const dGeomID geom = geom_of(def.shape, mass_of(def), mass);
    Item item{nullptr, def.pose, def.material.friction};
    if (def.motion != MotionType::fixed) {
      item.body = dBodyCreate(world_);
      if (def.motion == MotionType::dynamic)
        dBodySetMass(item.body, &mass);
      else
        dBodySetKinematic(item.body);
      dGeomSetBody(geom, item.body);
    }
    dGeomSetPosition(geom, real(p.x), real(p.y), real(p.z));
    dGeomSetQuaternion(geom, q);
    dGeomSetData(geom, reinterpret_cast<void*>(bodies_.size()));  // NOLINT: its index
    dGeomSetCategoryBits(geom, def.filter.category);
    dGeomSetCollideBits(geom, def.filter.mask);
    bodies_.push_back(item);
  }

  void add(const SceneJoint& joint) {
    const dJointID ball = dJointCreateBall(world_, nullptr);
    dJointAttach(ball, bodies_[joint.a].body, bodies_[joint.b].body);
    const Vec3 point = transform(bodies_[joint.a].start, joint.def.frame_a.position);
    dJointSetBallAnchor(ball, real(point.x), real(point.y), real(point.z));
  }

  static void meet(void* self, dGeomID a, dGeomID b) {
    OdeEngine& engine = *static_cast<OdeEngine*>(self);
    const dBodyID body_a = dGeomGetBody(a), body_b = dGeomGetBody(b);
    if (!body_a && !body_b) return;
    if (body_a && body_b && dAreConnectedExcluding(body_a, body_b, dJointTypeContact)) return;
    dContact contacts[max_contacts] = {};
    const int count = dCollide(a, b, max_contacts, &contacts[0].geom, sizeof(dContact));
    const float friction_a = engine.bodies_[reinterpret_cast<std::size_t>(dGeomGetData(a))].friction;
    const float friction_b = engine.bodies_[reinterpret_cast<std::size_t>(dGeomGetData(b))].friction;
    for (int i = 0; i < count; ++i) {
      // Coulomb's cone as a pyramid proportional to the normal force, its usual choice.
      contacts[i].surface.mode = dContactApprox1;
      contacts[i].surface.mu = real(std::sqrt(friction_a * friction_b));
      dJointAttach(dJointCreateContact(engine.world_, engine.joints_, &contacts[i]), body_a, body_b);
    }
  }

  dReal dt_;
  dWorldID world_;
  dSpaceID space_;
  dJointGroupID joints_;
  dThreadingImplementationID threading_ = nullptr;
  dThreadingThreadPoolID pool_ = nullptr;
  std::vector<Item> bodies_;
};

}  // namespace

EngineKind ode_engine() {
  return {"ode", FATHOM_ODE_VERSION, true, [](const Scene& scene, int threads) -> std::unique_ptr<Engine> {
            return std::make_unique<OdeEngine>(scene, threads);
          }};
}

}  // namespace fathom::peers
