#include "render/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "render/body_batches.hpp"
#include "render/gl_objects.hpp"
#include "render_shaders.hpp"

namespace fathom::render {
namespace {

/// As in frame.glsl (std140).
struct FrameBlock {
  Mat4 view_projection, shadow_matrix;
  Vec4 eye, camera_right, camera_up, camera_ahead, viewport;
  Vec4 sun_direction, sun_colour, ambient_up, ambient_down, zenith, horizon, nadir, extinction, ground, ground_line,
      water;
};

Vec4 padded(Vec3 v) { return {v.x, v.y, v.z, 0}; }

/// Clip space to texture coordinates; depth is already in [0, 1].
const Mat4 to_texture{{{0.5f, 0, 0, 0}, {0, 0.5f, 0, 0}, {0, 0, 1, 0}, {0.5f, 0.5f, 0, 1}}};

struct ShadowView {
  Mat4 view_projection;
  float texel = 0;  // m
};

/// The sun's view of the box, snapped to whole texels to avoid flickering shadows as the box moves.
ShadowView shadow_view(const Aabb& box, Vec3 sun, int size) {
  const Vec3 right = normalize(cross({0, 0, 1}, sun), {1, 0, 0}), up = cross(sun, right);
  const Mat4 view = view_matrix({}, right, up, sun);
  Aabb seen{{1e30f, 1e30f, 1e30f}, {-1e30f, -1e30f, -1e30f}};
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p{corner & 1 ? box.upper.x : box.lower.x, corner & 2 ? box.upper.y : box.lower.y,
                 corner & 4 ? box.upper.z : box.lower.z};
    const Vec4 q = view * Vec4{p.x, p.y, p.z, 1};
    seen = merged(seen, {{q.x, q.y, q.z}, {q.x, q.y, q.z}});
  }
  const Vec3 extent = seen.upper - seen.lower;
  // Keeps a border of two texels free of shadows, for the filter.
  const float texel = max(extent.x, extent.y) / static_cast<float>(size - 4);
  const auto snap = [texel](float v) { return texel * std::floor(v / texel); };
  const float side = texel * static_cast<float>(size);
  const Vec3 lower{snap(seen.lower.x) - texel, snap(seen.lower.y) - texel, seen.lower.z - 1};
  return {orthographic_matrix({lower, {lower.x + side, lower.y + side, seen.upper.z + 1}}) * view, texel};
}

std::string defines_of(Surface surface, int taps, bool water) {
  static constexpr const char* names[surface_count] = {"BOX", "ROUND", "CAPSULE", "HULL", "GROUND", "TERRAIN"};
  return std::string("#define ") + names[static_cast<std::size_t>(surface)] + "\n#define TAPS " + std::to_string(taps) +
         "\n" + (water ? "#define WATER\n" : "");
}

}  // namespace

class Renderer::Impl {
 public:
  explicit Impl(const RendererSettings& settings) : settings_(settings), poses_(settings.share_device_poses) {
    require_gl();
    const std::string frame = shaders::frame;
    for (int i = 0; i < surface_count; ++i) {
      depth_[i] = make_program("depth", defines_of(static_cast<Surface>(i), 0, false), frame + shaders::body_vert,
                               shaders::depth_frag);
    }
    sky_ = make_program("sky", "#define FAR_DEPTH 0.0\n", frame + shaders::sky_vert,
                        frame + shaders::light + shaders::sky_frag);
    overlay_ = make_program("overlay", "", frame + shaders::overlay_vert, shaders::overlay_frag);
    frame_buffer_ = make_buffer();
    glNamedBufferData(frame_buffer_.get(), sizeof(FrameBlock), nullptr, GL_STREAM_DRAW);
    empty_array_ = make_vertex_array();
    make_shadow_map(std::max(settings.shadow_size, 1));
  }

  void draw(const Frame& frame, GLuint framebuffer, int width, int height) {
    calls_ = 0;
    set_state();
    FrameBlock block = frame_block(frame, width, height);
    bind_buffers();
    if (settings_.shadow_size > 0) draw_shadows(frame, block);
    write_block(block);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, width, height);
    const float far = 0;  // depth is reversed
    glClearNamedFramebufferfv(framebuffer, GL_DEPTH, 0, &far);
    draw_bodies(lit_programs(frame.look.water), false);
    draw_sky();
    draw_marks(frame);
    poses_.drawn();
  }

  BodyBatches batches_;
  GrowingBuffer colours_;
  RendererSettings settings_;
  PoseBuffer poses_;
  int calls_ = 0;

 private:
  using Programs = GlProgram[surface_count];

  /// Created on first use.
  const Programs& lit_programs(bool water) {
    Programs& programs = lit_[water ? 1 : 0];
    const std::string text = std::string(shaders::frame) + shaders::light + shaders::surface + shaders::body_frag;
    for (int i = 0; i < surface_count && !programs[surface_count - 1]; ++i) {
      const int taps = settings_.shadow_size > 0 ? settings_.shadow_taps : 0;
      programs[i] = make_program("body", defines_of(static_cast<Surface>(i), taps, water),
                                 std::string(shaders::frame) + shaders::body_vert, text);
    }
    return programs;
  }

  void make_shadow_map(int size) {
    shadow_map_ = make_texture(GL_TEXTURE_2D);
    const GLuint map = shadow_map_.get();
    glTextureStorage2D(map, 1, GL_DEPTH_COMPONENT32F, size, size);
    glTextureParameteri(map, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTextureParameteri(map, GL_TEXTURE_COMPARE_FUNC, GL_GEQUAL);
    glTextureParameteri(map, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(map, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureParameteri(map, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTextureParameteri(map, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    shadow_framebuffer_ = make_framebuffer();
    glNamedFramebufferTexture(shadow_framebuffer_.get(), GL_DEPTH_ATTACHMENT, map, 0);
    glNamedFramebufferDrawBuffer(shadow_framebuffer_.get(), GL_NONE);
  }

  // Other code (the viewer's panel) draws in the same context and leaves its own state behind.
  static void set_state() {
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glDisable(GL_BLEND);
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_CULL_FACE);
    glEnable(GL_MULTISAMPLE);
    glFrontFace(GL_CCW);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GEQUAL);
    glDepthMask(GL_TRUE);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }

  FrameBlock frame_block(const Frame& frame, int width, int height) const {
    const float aspect = static_cast<float>(width) / static_cast<float>(height);
    const CameraAxes a = axes(frame.camera);
    const float half_height = std::tan(0.5f * frame.camera.field_of_view);
    const Look& look = frame.look;
    FrameBlock block;
    block.view_projection = view_projection(frame.camera, aspect);
    block.eye = padded(frame.camera.eye);
    block.camera_right = padded((aspect * half_height) * a.right);
    block.camera_up = padded(half_height * a.up);
    block.camera_ahead = padded(-a.back);
    block.viewport = {static_cast<float>(width), static_cast<float>(height), 0, 0};
    block.sun_direction = padded(look.sun_direction);
    block.sun_colour = padded(look.sun_colour);
    block.ambient_up = padded(look.ambient_up);
    block.ambient_down = padded(look.ambient_down);
    block.zenith = padded(look.zenith);
    block.horizon = padded(look.horizon);
    block.nadir = padded(look.nadir);
    block.extinction = padded(look.extinction);
    block.ground = padded(look.ground);
    block.ground_line = padded(look.ground_line);
    block.water = {look.water_surface, frame.time, 0, 0};
    return block;
  }

  void write_block(const FrameBlock& block) { glNamedBufferSubData(frame_buffer_.get(), 0, sizeof block, &block); }

  void bind_buffers() {
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, frame_buffer_.get());
    poses_.bind(0);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, batches_.instances());
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 2, colours_.get());
    glBindTextureUnit(0, shadow_map_.get());
  }

  void draw_shadows(const Frame& frame, FrameBlock& block) {
    const ShadowView view = shadow_view(frame.shadows, frame.look.sun_direction, settings_.shadow_size);
    FrameBlock from_sun = block;
    from_sun.view_projection = view.view_projection;
    write_block(from_sun);
    block.shadow_matrix = to_texture * view.view_projection;
    block.viewport.z = view.texel;
    glBindFramebuffer(GL_FRAMEBUFFER, shadow_framebuffer_.get());
    glViewport(0, 0, settings_.shadow_size, settings_.shadow_size);
    const float far = 0;
    glClearNamedFramebufferfv(shadow_framebuffer_.get(), GL_DEPTH, 0, &far);
    // Objects between the sun and the box cast shadows too.
    glEnable(GL_DEPTH_CLAMP);
    draw_bodies(depth_, true);
    glDisable(GL_DEPTH_CLAMP);
  }

  void draw_bodies(const Programs& programs, bool shadows) {
    for (const Batch& batch : batches_.batches()) {
      if (shadows && batch.surface == Surface::ground) continue;
      glUseProgram(programs[static_cast<std::size_t>(batch.surface)].get());
      calls_ += batch.mesh->draw(batch.first, batch.count);
    }
  }

  void draw_sky() {
    glUseProgram(sky_.get());
    glBindVertexArray(empty_array_.get());
    glDepthMask(GL_FALSE);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    ++calls_;
  }

  void draw_marks(const Frame& frame) {
    if (frame.marks.empty() && frame.marks_on_top.empty()) return;
    glUseProgram(overlay_.get());
    glBindVertexArray(empty_array_.get());
    glDisable(GL_CULL_FACE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    for (const auto marks : {frame.marks, frame.marks_on_top}) {
      if (!marks.empty()) {
        marks_.write(marks.data(), marks.size_bytes());
        glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, marks_.get());
        glDrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(6 * marks.size()));
        ++calls_;
      }
      glDisable(GL_DEPTH_TEST);  // for marks on top
    }
    glDisable(GL_BLEND);
  }

  Programs lit_[2], depth_;  // lit: in air, under water
  GlProgram sky_, overlay_;
  GlBuffer frame_buffer_;
  GlVertexArray empty_array_;
  GlTexture shadow_map_;
  GlFramebuffer shadow_framebuffer_;
  GrowingBuffer marks_;
};

RendererSettings settings_for_context() {
  RendererSettings settings;
  if (gl_description().find("llvmpipe") != std::string::npos) {
    settings.shadow_size = 2048;
    settings.shadow_taps = 2;
  }
  return settings;
}

Renderer::Renderer(const RendererSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

void Renderer::set_bodies(std::span<const DrawnBody> bodies) { impl_->batches_.set(bodies); }
void Renderer::set_colours(std::span<const Colour> colours) {
  impl_->colours_.write(colours.data(), colours.size_bytes());
}
PoseBuffer& Renderer::poses() { return impl_->poses_; }
void Renderer::draw(const Frame& frame, GLuint framebuffer, int width, int height) {
  impl_->draw(frame, framebuffer, width, height);
}
int Renderer::draw_calls() const { return impl_->calls_; }

Aabb shadow_region(const Aabb& box, const Camera& camera) {
  const float reach = 1.5f * distance(camera.eye, camera.target);
  const Vec3 r{reach, reach, reach};
  const Aabb near{camera.target - r, camera.target + r};
  if (!overlaps(box, near)) return near;
  return {max(box.lower, near.lower), min(box.upper, near.upper)};
}

}  // namespace fathom::render
