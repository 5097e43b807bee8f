// Time of an off-screen frame, by number of bodies and by the path of the poses: from host memory, from a CUDA device
// through the host, or within the GPU's memory.
//
//   render_bench [--bodies 10000,100000,1000000] [--frames 60] [--size 1280x720] [--samples 4] [--shadows 4096]
//                [--gpu auto] [--pictures FOLDER] [--device cuda]
//
// With --device it also simulates on that device: a frame is then a step of `spread` or `drift`, and its picture.
#ifdef FATHOM_WITH_CUDA_POSES
#include <cuda_runtime_api.h>
#endif

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fathom/error.hpp>
#include <string>
#include <vector>

#include "render/egl_context.hpp"
#include "render/gl_objects.hpp"
#include "render/render_target.hpp"
#include "render/renderer.hpp"
#include "render/world_picture.hpp"
#include "scene/environments.hpp"
#include "scene/scene.hpp"

namespace {

using namespace fathom;
using namespace fathom::render;

struct Options {
  std::vector<std::size_t> bodies{10'000, 100'000, 1'000'000};
  int frames = 60, width = 1280, height = 720, samples = 4, shadows = 4096;
  std::string gpu = "auto", pictures, device;
};

[[noreturn]] void refuse(const std::string& text) { throw Error(ErrorCode::invalid_argument, text); }

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; i += 2) {
    const std::string flag = argv[i];
    if (i + 1 == argc) refuse(flag + " needs a value");
    const std::string value = argv[i + 1];
    if (flag == "--bodies") {
      options.bodies.clear();
      for (std::size_t at = 0; at != std::string::npos;
           at = value.find(',', at) == std::string::npos ? std::string::npos : value.find(',', at) + 1)
        options.bodies.push_back(std::stoul(value.substr(at)));
    } else if (flag == "--frames") {
      options.frames = std::max(1, std::stoi(value));
    } else if (flag == "--size") {
      if (std::sscanf(value.c_str(), "%dx%d", &options.width, &options.height) != 2) refuse("--size must be WxH");
    } else if (flag == "--samples") {
      options.samples = std::stoi(value);
    } else if (flag == "--shadows") {
      options.shadows = std::stoi(value);
    } else if (flag == "--gpu") {
      options.gpu = value;
    } else if (flag == "--device") {
      options.device = value;
    } else if (flag == "--pictures") {
      options.pictures = value;
    } else {
      refuse("unknown option " + flag + "; see the head of bench/render_bench.cpp");
    }
  }
  return options;
}

/// Cubes in a square block of ten layers, each slightly turned; `phase` moves them.
std::vector<Pose> block(std::size_t count, float phase) {
  const auto side = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(count) / 10)));
  std::vector<Pose> poses(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = static_cast<float>(i % side), y = static_cast<float>(i / side % side);
    const auto z = static_cast<float>(i / (side * side));
    const float half = 0.5f * static_cast<float>(side), angle = phase + 0.05f * (x + y);
    poses[i].position = {1.5f * (x - half), 1.5f * (y - half), 1.5f * z + 0.5f + 0.2f * std::sin(angle)};
    poses[i].rotation = {std::cos(angle), 0, 0, std::sin(angle)};
  }
  return poses;
}

struct Times {
  double median = 0, p99 = 0, cpu = 0;  // ms
};

/// Times frames until they have finished. `write` passes the poses of a frame to the renderer.
template <class Write>
Times measure(Renderer& renderer, const Frame& frame, const OffscreenTarget& target, int frames, const Write& write) {
  using Clock = std::chrono::steady_clock;
  const auto ms = [](Clock::time_point a, Clock::time_point b) {
    return std::chrono::duration<double, std::milli>(b - a).count();
  };
  std::vector<double> times;
  double submitted = 0;
  const int warm_up = std::min(5, frames);
  for (int i = 0; i < frames + warm_up; ++i) {
    const Clock::time_point start = Clock::now();
    write(i);
    renderer.draw(frame, target.framebuffer(), target.width(), target.height());
    const Clock::time_point handed_over = Clock::now();
    glFinish();
    if (i < warm_up) continue;
    times.push_back(ms(start, Clock::now()));
    submitted += ms(start, handed_over);
  }
  std::sort(times.begin(), times.end());
  return {times[times.size() / 2], times[(times.size() * 99 + 99) / 100 - 1], submitted / frames};
}

void report(std::size_t bodies, const char* way, const Times& t) {
  std::printf("%9zu  %-28s %9.3f %9.3f %9.3f %9.1f\n", bodies, way, t.median, t.p99, t.cpu, 1000 / t.median);
  std::fflush(stdout);
}

#ifdef FATHOM_WITH_CUDA_POSES
void check(cudaError_t status) {
  if (status != cudaSuccess) throw std::runtime_error(std::string("CUDA: ") + cudaGetErrorString(status));
}

/// Poses in device memory.
class OnDevice {
 public:
  explicit OnDevice(const std::vector<Pose>& poses) : count_(poses.size()) {
    check(cudaMalloc(&memory_, count_ * sizeof(Pose)));
    check(cudaMemcpy(memory_, poses.data(), count_ * sizeof(Pose), cudaMemcpyHostToDevice));
  }
  ~OnDevice() { cudaFree(memory_); }
  OnDevice(const OnDevice&) = delete;
  OnDevice& operator=(const OnDevice&) = delete;
  DevicePoses poses() const { return {memory_, count_}; }

 private:
  void* memory_ = nullptr;
  std::size_t count_;
};
#endif

void run(std::size_t count, const Options& options, int cuda_device) {
  const std::vector<Pose> poses[2] = {block(count, 0), block(count, 0.3f)};
  std::vector<DrawnBody> bodies(count);
  std::vector<Colour> colours(count);
  const Shape cube = box({0.5f, 0.5f, 0.5f});
  Aabb bounds{poses[0][0].position, poses[0][0].position};
  for (std::size_t i = 0; i < count; ++i) {
    bodies[i] = {static_cast<std::uint32_t>(i), cube, false};
    colours[i] = scattered(i);
    bounds = merged(bounds, {poses[0][i].position, poses[0][i].position});
  }
  bounds = grown(bounds, 1);
  OffscreenTarget target(options.width, options.height, options.samples);
  const float aspect = static_cast<float>(options.width) / static_cast<float>(options.height);
  Frame frame;
  frame.camera = camera_on(bounds, -0.96f, 0.42f, aspect);
  frame.look = render::daylight(length(bounds.upper - bounds.lower));
  frame.shadows = shadow_region(bounds, frame.camera);

  const auto prepared = [&](bool share) {
    RendererSettings settings;
    settings.shadow_size = options.shadows;
    settings.share_device_poses = share;
    Renderer renderer(settings);
    renderer.set_bodies(bodies);
    renderer.set_colours(colours);
    return renderer;
  };
  const auto picture = [&](const std::string& name) {
    if (options.pictures.empty()) return;
    Image image;
    target.read(image);
    write_png(image, options.pictures + "/" + name + "-" + std::to_string(count) + ".png");
  };
  {
    Renderer renderer = prepared(false);
    report(count, "host poses",
           measure(renderer, frame, target, options.frames, [&](int i) { renderer.poses().write(poses[i % 2]); }));
    picture("host");
  }
#ifdef FATHOM_WITH_CUDA_POSES
  if (cuda_device < 0) return;
  check(cudaSetDevice(cuda_device));
  const OnDevice on_device[2] = {OnDevice(poses[0]), OnDevice(poses[1])};
  for (const bool share : {false, true}) {
    Renderer renderer = prepared(share);
    const Times times = measure(renderer, frame, target, options.frames,
                                [&](int i) { renderer.poses().write(on_device[i % 2].poses()); });
    report(count, renderer.poses().shared() ? "CUDA poses, shared buffer" : "CUDA poses, through the host", times);
    picture(share ? "shared" : "copied");
  }
#else
  (void)cuda_device;
#endif
}

/// Frames of a stepping world, by the path of its poses to the picture.
void run_world(const char* name, std::size_t count, const Options& options) {
  const OffscreenTarget target(options.width, options.height, options.samples);
  const float aspect = static_cast<float>(options.width) / static_cast<float>(options.height);
  enum class Way { none, host, staged, shared };
  for (const Way way : {Way::none, Way::host, Way::staged, Way::shared}) {
    Scene scene = find_environment(name)->make(static_cast<std::int64_t>(count));
    scene.world.simulator = SimulatorKind::device;
    scene.world.device = options.device;
    World world(scene.world);
    SceneInstance instance(scene, world);
    RendererSettings settings;
    settings.shadow_size = options.shadows;
    settings.share_device_poses = way == Way::shared;
    Renderer renderer(settings);
    WorldPicture picture;
    picture.update(world, renderer);
    const Aabb bounds = picture.moving();
    Frame frame;
    frame.camera = camera_on(bounds, -0.96f, 0.42f, aspect);
    frame.look = render::daylight(length(bounds.upper - bounds.lower));
    frame.shadows = shadow_region(bounds, frame.camera);
    const Times times = measure(renderer, frame, target, options.frames, [&](int) {
      instance.prepare_step();
      world.step();
      const bool asks = way == Way::staged || way == Way::shared;
      const auto on_device = asks ? world.device_poses() : std::nullopt;
      if (asks && !on_device) refuse("--device " + options.device + " has no poses to share; use cuda");
      if (way == Way::none)
        world.wait();
      else if (on_device)
        renderer.poses().write(*on_device);
      else
        renderer.poses().write(world.poses());
    });
    std::string what = std::string(name) + ", ";
    if (way == Way::none) what += "still picture";
    if (way == Way::host) what += "World::poses";
    if (way == Way::staged) what += "poses staged";
    if (way == Way::shared) what += renderer.poses().shared() ? "shared buffer" : "NOT shared";
    report(world.body_count(), what.c_str(), times);
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Options options = parse(argc, argv);
    const auto context = make_offscreen_context(parse_gpu(options.gpu));
    std::printf("%s, CUDA device %d; %dx%d, %d samples, shadow map %d, %d frames\n", gl_description().c_str(),
                context->cuda_device(), options.width, options.height, options.samples, options.shadows,
                options.frames);
    std::printf("%9s  %-28s %9s %9s %9s %9s\n", "bodies", "poses", "median ms", "p99 ms", "submit ms", "frames/s");
    for (const std::size_t count : options.bodies) run(count, options, context->cuda_device());
    if (!options.device.empty()) {
      for (const char* name : {"spread", "drift"})
        for (const std::size_t count : options.bodies) run_world(name, count, options);
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "render_bench: %s\n", error.what());
    return 1;
  }
}
