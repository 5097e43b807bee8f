#include "viewer/panel.hpp"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string_view>

#include "scene/environments.hpp"

namespace fathom::viewer {
namespace {

constexpr float widest = 330, narrowest = 230;  // of the panel (pixels of the display)
constexpr float tall = 700;                     // display height from which everything is initially open
constexpr float chart_height = 110;

struct Stage {
  const char* name;
  double StageTimes::*time;
  ImU32 colour;
};
const Stage stages[] = {{"find pairs", &StageTimes::find_pairs, IM_COL32(62, 124, 190, 255)},
                        {"update manifolds", &StageTimes::update_manifolds, IM_COL32(42, 150, 140, 255)},
                        {"build constraints", &StageTimes::build_constraints, IM_COL32(240, 168, 56, 255)},
                        {"solve", &StageTimes::solve, IM_COL32(224, 92, 80, 255)},
                        {"finish", &StageTimes::finish, IM_COL32(126, 104, 176, 255)}};

/// A choice of one of several words; true if it changed.
template <class T, std::size_t n>
bool choose(const char* label, std::optional<T>& value, T present, const std::pair<const char*, T> (&words)[n]) {
  const T now = value.value_or(present);
  const char* shown = "";
  for (const auto& [word, meaning] : words)
    if (meaning == now) shown = word;
  bool changed = false;
  if (ImGui::BeginCombo(label, shown)) {
    for (const auto& [word, meaning] : words) {
      if (ImGui::Selectable(word, meaning == now)) {
        value = meaning;
        changed = true;
      }
    }
    ImGui::EndCombo();
  }
  return changed;
}

bool choose_simulator(const WorldDef& def, const std::vector<SimulatorChoice>& simulators, Choice& choice) {
  const auto is_present = [&def](const SimulatorChoice& s) {
    return s.kind == def.simulator && (s.kind == SimulatorKind::native || s.device == def.device);
  };
  const auto present = std::ranges::find_if(simulators, is_present);
  bool changed = false;
  if (ImGui::BeginCombo("simulator", present != simulators.end() ? present->name.c_str() : def.device.c_str())) {
    for (const SimulatorChoice& simulator : simulators) {
      if (ImGui::Selectable(simulator.name.c_str(), is_present(simulator))) {
        choice.simulator = simulator.kind;
        choice.device.clear();
        if (simulator.kind != SimulatorKind::native) choice.device = simulator.device;
        changed = true;
      }
    }
    ImGui::EndCombo();
  }
  return changed;
}

/// Scene, size and simulator; true if any changed.
bool choose_scene(const Session& session, const std::vector<SimulatorChoice>& simulators, Choice& choice) {
  bool changed = false;
  if (ImGui::BeginCombo("scene", choice.scene.c_str())) {
    for (const Environment& environment : environments()) {
      const std::string name(environment.name);
      if (ImGui::Selectable(name.c_str(), name == choice.scene)) {
        choice.scene = name;
        choice.bodies.reset();
        changed = true;
      }
    }
    ImGui::EndCombo();
  }
  if (find_environment(choice.scene)) {
    // Shows the actual number, which may differ from the requested one because layers are always full. Takes effect
    // when the slider is released or a number typed in (Ctrl and click).
    const auto bodies = static_cast<int>(dynamic_body_count(session.scene()));
    static int moving = 0;
    static bool held = false;
    if (!held) moving = bodies;
    ImGui::SliderInt("bodies", &moving, 1, std::max(100'000, bodies), "%d", ImGuiSliderFlags_Logarithmic);
    held = ImGui::IsItemActive();
    if (ImGui::IsItemDeactivatedAfterEdit()) {
      choice.bodies = std::max(1, moving);
      changed = true;
    }
  }
  const WorldDef& def = session.world().definition();
  changed |= choose_simulator(def, simulators, choice);
  changed |= choose<Solver>("solver", choice.solver, def.solver.method,
                            {{"soft", Solver::soft}, {"impulse", Solver::impulse}});
  changed |= choose<BroadPhase>("broad phase", choice.broad_phase, def.broad_phase,
                                {{"tree", BroadPhase::tree}, {"sweep", BroadPhase::sweep}});
  int threads = choice.threads.value_or(def.threads), substeps = choice.substeps.value_or(def.solver.substeps);
  if (ImGui::InputInt("threads", &threads) && threads >= 1 && threads <= WorldDef::max_threads) {
    choice.threads = threads;
    changed = true;
  }
  if (ImGui::InputInt("substeps", &substeps) && substeps >= 1 && substeps <= SolverSettings::max_substeps) {
    choice.substeps = substeps;
    changed = true;
  }
  bool sleep = choice.sleep.value_or(def.sleep.enabled);
  if (ImGui::Checkbox("resting islands sleep", &sleep)) {
    choice.sleep = sleep;
    changed = true;
  }
  return changed;
}

/// The last steps as a stacked bar chart, one bar per step.
void draw_chart(const std::deque<StageTimes>& history) {
  double highest = 0, sum = 0;
  for (const StageTimes& times : history) {
    highest = std::max(highest, times.total());
    sum += times.total();
  }
  // The scale changes by powers of two to avoid jitter.
  const double scale = std::max(0.1, std::pow(2.0, std::ceil(std::log2(std::max(highest, 1e-3)))));
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const ImVec2 size{ImGui::GetContentRegionAvail().x, chart_height};
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(corner, {corner.x + size.x, corner.y + size.y}, IM_COL32(255, 255, 255, 14), 4);
  const float column = size.x / 240.0f;
  float x = corner.x + size.x - column * static_cast<float>(history.size());
  for (const StageTimes& times : history) {
    float y = corner.y + size.y;
    for (const Stage& stage : stages) {
      const float top = y - static_cast<float>(times.*stage.time / scale) * size.y;
      list.AddRectFilled({x, top}, {x + column + 0.5f, y}, stage.colour);
      y = top;
    }
    x += column;
  }
  char text[64];
  std::snprintf(text, sizeof text, "%.3g ms", scale);
  list.AddText({corner.x + 6, corner.y + 4}, IM_COL32(255, 255, 255, 160), text);
  ImGui::Dummy(size);
  if (history.empty()) return;
  ImGui::TextWrapped("step %.3f ms, mean %.3f, highest %.3f", history.back().total(),
                     sum / static_cast<double>(history.size()), highest);
}

/// Each stage on its own scale.
void draw_plots(const std::deque<StageTimes>& history) {
  for (const Stage& stage : stages) {
    std::vector<float> values;
    for (const StageTimes& times : history) values.push_back(static_cast<float>(times.*stage.time));
    const float now = values.empty() ? 0 : values.back();
    char text[64];
    std::snprintf(text, sizeof text, "%.3f ms", static_cast<double>(now));
    ImGui::PushStyleColor(ImGuiCol_PlotLines, stage.colour);
    ImGui::PlotLines(stage.name, values.data(), static_cast<int>(values.size()), 0, text, 0,
                     std::numeric_limits<float>::max(), {0.55f * ImGui::GetContentRegionAvail().x, 26});
    ImGui::PopStyleColor();
  }
}

void show_counts(const Session& session, const ViewState& state) {
  const Profile& profile = session.world().profile();
  const StepCounts& c = profile.counts;
  ImGui::TextWrapped("%.1f s simulated, %.0f frames/s", session.world().time(),
                     static_cast<double>(1000 / std::max(state.frame_ms, 0.01f)));
  ImGui::TextWrapped("%u bodies, %u awake, %u islands", session.world().body_count(), c.active, c.islands);
  ImGui::TextWrapped("%u pairs, %u touch at %u points", c.pairs, c.manifolds, c.points);
  ImGui::TextWrapped("%u colours, %u contacts in none, %.1f MiB", c.colours, c.overflow,
                     static_cast<double>(c.memory_bytes) / (1024 * 1024));
}

void choose_view(ViewState& state) {
  const std::pair<const char*, bool*> boxes[] = {
      {"boxes", &state.overlays.boxes},         {"points", &state.overlays.points},
      {"normals", &state.overlays.normals},     {"impulses", &state.overlays.impulses},
      {"graph", &state.overlays.graph},         {"joints, limits", &state.overlays.joints},
      {"reactions", &state.overlays.reactions}, {"through bodies", &state.overlays.see_through}};
  const float column = 0.5f * ImGui::GetContentRegionAvail().x;
  for (std::size_t i = 0; i < std::size(boxes); ++i) {
    if (i % 2 == 1) ImGui::SameLine(column + ImGui::GetStyle().WindowPadding.x);
    ImGui::Checkbox(boxes[i].first, boxes[i].second);
  }
  int colouring = static_cast<int>(state.colouring), look = static_cast<int>(state.look);
  ImGui::Combo("colours", &colouring, "start\0speed\0islands\0");
  ImGui::Combo("look", &look, "daylight\0water\0");
  state.colouring = static_cast<render::Colouring>(colouring);
  state.look = static_cast<render::LookKind>(look);
}

void draw_help(float left) {
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  ImGui::SetNextWindowPos({0.5f * (screen.x + left), 0.5f * screen.y}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSizeConstraints({200, 100}, {std::max(200.0f, screen.x - left - 16), screen.y - 16});
  ImGui::Begin("Help", nullptr, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
  static constexpr const char* lines[][2] = {{"left button on a body", "drag it"},
                                             {"left elsewhere, right", "turn"},
                                             {"middle, or with Shift", "move"},
                                             {"wheel", "zoom"},
                                             {"W A S D, Q E", "fly"},
                                             {"F", "shoot a box"},
                                             {"Space", "pause, continue"},
                                             {".", "one step"},
                                             {"R", "start again"},
                                             {"Z", "undo"},
                                             {"C", "see everything"},
                                             {"1 to 7", "overlays, as in View"},
                                             {"X", "overlays through bodies"},
                                             {"I, V", "colours: island, speed"},
                                             {"U", "under water"},
                                             {"Tab", "panel"},
                                             {"P", "picture: fathom.png"},
                                             {"H, F1", "this help"},
                                             {"Esc", "quit"},
                                             {"drop a scene file", "open it"}};
  for (const auto& line : lines) {
    ImGui::TextUnformatted(line[0]);
    ImGui::SameLine(190);
    ImGui::TextUnformatted(line[1]);
  }
  ImGui::End();
}

}  // namespace

float panel_width() { return std::clamp(0.3f * ImGui::GetIO().DisplaySize.x, narrowest, widest); }

PanelRequest draw_panel(const Session& session, const std::vector<SimulatorChoice>& simulators, ViewState& state) {
  PanelRequest request;
  if (state.show_help) draw_help(state.show_panel ? panel_width() : 0);
  if (!state.show_panel) return request;
  const float height = ImGui::GetIO().DisplaySize.y;
  ImGui::SetNextWindowPos({0, 0}, ImGuiCond_Always);
  ImGui::SetNextWindowSize({panel_width(), height}, ImGuiCond_Always);
  ImGui::Begin("Fathom", nullptr,
               ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoTitleBar |
                   ImGuiWindowFlags_NoFocusOnAppearing);
  const float gap = ImGui::GetStyle().ItemSpacing.x, third = (ImGui::GetContentRegionAvail().x - 2 * gap) / 3;
  const auto button = [&](const char* name, bool last) {
    const bool pressed = ImGui::Button(name, {third, 0});
    if (!last) ImGui::SameLine();
    return pressed;
  };
  if (button(state.paused ? "Continue" : "Pause", false)) state.paused = !state.paused;
  if (button("Step", false)) state.paused = state.single_step = true;
  ImGui::BeginDisabled(session.undoable() == 0);
  request.undo = button("Undo", true);
  ImGui::EndDisabled();
  request.reset = button("Reset", false);
  request.shoot = button("Shoot", false);
  if (button("Help", true)) state.show_help = !state.show_help;
  if (!state.message.empty()) ImGui::TextWrapped("%s", state.message.c_str());
  ImGui::TextWrapped("Simulated time per second of real time:");
  ImGui::Text("%.2f s wanted, %.2f s achieved", static_cast<double>(state.speed),
              static_cast<double>(state.reached_speed));
  ImGui::PushItemWidth(-1);
  ImGui::SliderFloat("##speed", &state.speed, 0.05f, 4, "", ImGuiSliderFlags_Logarithmic);
  ImGui::PopItemWidth();
  show_counts(session, state);
  const ImGuiTreeNodeFlags open = height >= tall ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None;
  ImGui::PushItemWidth(0.58f * ImGui::GetContentRegionAvail().x);
  if (ImGui::CollapsingHeader("Scene", open)) {
    Choice choice = session.choice();
    if (choose_scene(session, simulators, choice)) request.choice = choice;
  }
  if (ImGui::CollapsingHeader("Times", open)) {
    draw_chart(session.history());
    draw_plots(session.history());
  }
  if (ImGui::CollapsingHeader("View", open)) choose_view(state);
  ImGui::PopItemWidth();
  ImGui::End();
  return request;
}

}  // namespace fathom::viewer
