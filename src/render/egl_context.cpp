#include "render/egl_context.hpp"

#include <dlfcn.h>
#include <epoxy/egl.h>

#include <cstring>
#include <fathom/error.hpp>
#include <vector>

#include "render/gl_objects.hpp"

namespace fathom::render {
namespace {

constexpr const char* remedy =
    "; install libegl1 and a driver (Mesa's libegl-mesa0 and libgl1-mesa-dri draw in software)";

bool has_word(const char* words, const char* word) {
  return words && (" " + std::string(words) + " ").find(" " + std::string(word) + " ") != std::string::npos;
}

/// A device to request a display from.
struct Candidate {
  EGLDeviceEXT device = nullptr;  // null: Mesa's surfaceless platform
  bool software = false;
  int cuda_device = -1;
};

std::vector<Candidate> list_devices() {
  std::vector<Candidate> found;
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  if (has_word(client, "EGL_EXT_device_enumeration") || has_word(client, "EGL_EXT_device_base")) {
    EGLDeviceEXT devices[64];
    EGLint count = 0;
    if (eglQueryDevicesEXT(64, devices, &count)) {
      for (EGLint i = 0; i < count; ++i) {
        const char* extensions = eglQueryDeviceStringEXT(devices[i], EGL_EXTENSIONS);
        Candidate candidate{devices[i], has_word(extensions, "EGL_MESA_device_software"), -1};
        EGLAttrib ordinal = 0;
        if (has_word(extensions, "EGL_NV_device_cuda") &&
            eglQueryDeviceAttribEXT(devices[i], EGL_CUDA_DEVICE_NV, &ordinal)) {
          candidate.cuda_device = static_cast<int>(ordinal);
        }
        found.push_back(candidate);
      }
    }
  }
  return found;
}

/// Candidates to try, in order.
std::vector<Candidate> select(const GpuChoice& choice) {
  const std::vector<Candidate> devices = list_devices();
  std::vector<Candidate> selected;
  if (choice.kind == GpuChoice::Kind::numbered) {
    if (choice.number >= static_cast<int>(devices.size())) {
      throw Error(ErrorCode::unavailable, "there is no graphics device " + std::to_string(choice.number) + " among " +
                                              std::to_string(devices.size()) + "; use --gpu auto");
    }
    return {devices[choice.number]};
  }
  if (choice.kind == GpuChoice::Kind::automatic) {
    for (const Candidate& candidate : devices)
      if (!candidate.software) selected.push_back(candidate);
  }
  for (const Candidate& candidate : devices)
    if (candidate.software) selected.push_back(candidate);
  if (has_word(eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS), "EGL_MESA_platform_surfaceless")) {
    selected.push_back({nullptr, true, -1});
  }
  return selected;
}

class EglContext final : public OffscreenContext {
 public:
  /// Throws `Error{unavailable}` if the candidate does not work.
  explicit EglContext(const Candidate& candidate) : cuda_device_(candidate.cuda_device) {
    display_ = candidate.device ? eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, candidate.device, nullptr)
                                : eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr);
    if (display_ == EGL_NO_DISPLAY || !eglInitialize(display_, nullptr, nullptr)) refuse("no display could be opened");
    try {
      make_current();
      require_gl();
    } catch (...) {
      close();
      throw;
    }
  }

  ~EglContext() override { close(); }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  int cuda_device() const override { return cuda_device_; }

 private:
  [[noreturn]] static void refuse(const std::string& what) {
    throw Error(ErrorCode::unavailable, "drawing without a window: " + what + remedy);
  }

  void make_current() {
    if (!eglBindAPI(EGL_OPENGL_API)) refuse("EGL has no OpenGL here");
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = EGL_NO_CONFIG_KHR;
    EGLint count = 0;
    if (!eglChooseConfig(display_, wanted, &config, 1, &count) || count == 0) config = EGL_NO_CONFIG_KHR;
    const EGLint attributes[] = {
        EGL_CONTEXT_MAJOR_VERSION,           4,       EGL_CONTEXT_MINOR_VERSION, 5, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    context_ = eglCreateContext(display_, config, EGL_NO_CONTEXT, attributes);
    if (context_ == EGL_NO_CONTEXT) refuse("the driver offers no OpenGL 4.5");
    if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_)) refuse("the context cannot be used");
  }

  void close() {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context_ != EGL_NO_CONTEXT) eglDestroyContext(display_, context_);
    context_ = EGL_NO_CONTEXT;
    eglTerminate(display_);
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  int cuda_device_;
};

/// libepoxy aborts if a library is missing, so check for it first.
void require_library(const char* name) {
  void* handle = dlopen(name, RTLD_LAZY | RTLD_LOCAL);
  if (!handle) throw Error(ErrorCode::unavailable, std::string("there is no ") + name + " on this machine" + remedy);
  dlclose(handle);
}

}  // namespace

GpuChoice parse_gpu(const std::string& text) {
  if (text == "auto") return {};
  if (text == "software") return {GpuChoice::Kind::software, 0};
  if (!text.empty() && text.size() < 4 && text.find_first_not_of("0123456789") == std::string::npos) {
    return {GpuChoice::Kind::numbered, std::stoi(text)};
  }
  throw Error(ErrorCode::invalid_argument, "--gpu must be auto, software or a device's number, not " + text);
}

std::unique_ptr<OffscreenContext> make_offscreen_context(const GpuChoice& choice) {
  require_library("libEGL.so.1");
  require_library("libGL.so.1");
  std::string last = std::string("drawing without a window: EGL lists no device") + remedy;
  for (const Candidate& candidate : select(choice)) {
    try {
      return std::make_unique<EglContext>(candidate);
    } catch (const Error& error) {
      last = error.what();
    }
  }
  throw Error(ErrorCode::unavailable, last);
}

}  // namespace fathom::render
