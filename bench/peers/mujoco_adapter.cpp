// MuJoCo: Newton's method on its convex contact model, from a model in its XML format. One thread.
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cstring>

#include "engine.hpp"

namespace fathom::peers {
namespace {

// A cube in a pyramid touches four below and four above, each pair with up to 4 points; a point has 4 rows.
constexpr double contacts_a_body = 16, rows_a_contact = 4;

/// What this version reserves for constraints, needed or not: J and its transpose, A and indices.
double bytes_for(double bodies) {
  const double rows = rows_a_contact * contacts_a_body * bodies, freedoms = 6 * bodies;
  return 12 * (2 * rows * freedoms + rows * rows);
}

std::string form_of(const Shape& shape) {
  const Vec3 half = shape.half_extents;
  switch (shape.type) {
    case ShapeType::sphere:
      return fmt::format("type='sphere' size='{}'", shape.radius);
    case ShapeType::capsule:
      return fmt::format("type='capsule' size='{} {}'", shape.radius, half.z);
    case ShapeType::box:
      return fmt::format("type='box' size='{} {} {}'", half.x, half.y, half.z);
    case ShapeType::mesh:
    case ShapeType::height_field:
    case ShapeType::compound:
      refuse_shape("MuJoCo");
    case ShapeType::hull:
      break;
  }
  refuse_scene("MuJoCo", "hulls");
}

std::string geom(const BodyDef& def) {
  if (def.motion == MotionType::kinematic) refuse_scene("MuJoCo", "kinematic bodies, whose velocity no contact sees");
  return fmt::format("<geom {} friction='{} 0.005 0.0001' mass='{}'/>", form_of(def.shape), def.material.friction,
                     def.motion == MotionType::dynamic ? mass_of(def) : 0.0f);
}

std::string xml_of(const Scene& scene) {
  const double contacts = contacts_a_body * static_cast<double>(scene.bodies.size());
  const Vec3 g = scene.world.gravity;
  std::string xml = fmt::format(
      "<mujoco><option timestep='{}' gravity='{} {} {}'/><size nconmax='{}' njmax='{}'/><worldbody>\n", scene.world.dt,
      g.x, g.y, g.z, static_cast<int>(contacts), static_cast<int>(rows_a_contact * contacts));
  for (const BodyDef& def : scene.bodies) {
    const Vec3 p = def.pose.position;
    const Quat q = def.pose.rotation;
    xml += fmt::format("<body pos='{} {} {}' quat='{} {} {} {}'>{}{}</body>\n", p.x, p.y, p.z, q.w, q.x, q.y, q.z,
                       def.motion == MotionType::dynamic ? "<freejoint/>" : "", geom(def));
  }
  return xml + "</worldbody></mujoco>\n";
}

[[noreturn]] void refuse(const char* message) {
  throw Error(ErrorCode::unavailable, std::string("MuJoCo: ") + message);
}

mjModel* load(const std::string& xml) {
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  mj_makeEmptyFileVFS(files.get(), "scene.xml", static_cast<int>(xml.size()));
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), "scene.xml")], xml.data(), xml.size());
  char error[500] = {};
  mjModel* model = mj_loadXML("scene.xml", files.get(), error, sizeof error);
  mj_deleteVFS(files.get());
  if (!model) refuse(error);
  return model;
}

class MujocoEngine final : public Engine {
 public:
  explicit MujocoEngine(const Scene& scene) : scene_(scene) {
    refuse_joints("MuJoCo", scene);
    const double needed = bytes_for(static_cast<double>(scene.bodies.size()));
    if (needed >= 0x1p31)
      throw Error(ErrorCode::unavailable,
                  fmt::format("would need {:.1f} GiB for constraints, and this version stops at 2", needed / 0x1p30));
    mju_user_error = refuse;
    model_.reset(load(xml_of(scene)));
    data_.reset(mj_makeData(model_.get()));
  }

  void step() override { mj_step(model_.get(), data_.get()); }

  // Moving bodies have 7 coordinates (position, quaternion) and 6 velocities in sequence, the angular ones in the
  // body's axes.
  void read(std::span<Pose> poses, std::span<Velocity> velocities) const override {
    const mjtNum *q = data_->qpos, *v = data_->qvel;
    for (std::size_t i = 0; i < scene_.bodies.size(); ++i) {
      poses[i] = scene_.bodies[i].pose;
      velocities[i] = {};
      if (scene_.bodies[i].motion != MotionType::dynamic) continue;
      poses[i].position = vector(q);
      poses[i].rotation = {narrow(q[3]), narrow(q[4]), narrow(q[5]), narrow(q[6])};
      velocities[i] = {vector(v), 0, rotate(poses[i].rotation, vector(v + 3)), 0};
      q += 7, v += 6;
    }
  }

  void set_velocity(std::size_t body, const Velocity& velocity) override {
    const auto before = static_cast<std::size_t>(
        std::count_if(scene_.bodies.begin(), scene_.bodies.begin() + static_cast<std::ptrdiff_t>(body),
                      [](const BodyDef& def) { return def.motion == MotionType::dynamic; }));
    const mjtNum* q = data_->qpos + 7 * before + 3;
    const Vec3 spin = inverse_rotate({narrow(q[0]), narrow(q[1]), narrow(q[2]), narrow(q[3])}, velocity.angular);
    mjtNum* v = data_->qvel + 6 * before;
    for (const float component : {velocity.linear.x, velocity.linear.y, velocity.linear.z, spin.x, spin.y, spin.z})
      *v++ = static_cast<mjtNum>(component);
  }

  std::string trouble() const override {
    for (int i = 0; i < mjNWARNING; ++i)
      if (data_->warning[i].number > 0) return mju_warningText(i, data_->warning[i].lastinfo);
    return {};
  }

 private:
  static float narrow(mjtNum value) { return static_cast<float>(value); }
  static Vec3 vector(const mjtNum* v) { return {narrow(v[0]), narrow(v[1]), narrow(v[2])}; }

  struct Delete {
    void operator()(mjModel* model) const { mj_deleteModel(model); }
    void operator()(mjData* data) const { mj_deleteData(data); }
  };

  const Scene& scene_;
  std::unique_ptr<mjModel, Delete> model_;
  std::unique_ptr<mjData, Delete> data_;
};

}  // namespace

EngineKind mujoco_engine() {
  return {"mujoco", mj_versionString(), false,
          [](const Scene& scene, int) -> std::unique_ptr<Engine> { return std::make_unique<MujocoEngine>(scene); }};
}

}  // namespace fathom::peers
