#include "store.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <charconv>
#include <ctime>
#include <filesystem>
#include <thread>

#include "build_info.hpp"
#include "exec/devices.hpp"
#include "files/input_file.hpp"
#include "measure/json.hpp"
#include "measure/system.hpp"

namespace fathom::campaign {
namespace {

namespace fs = std::filesystem;

constexpr int format = 1;

Quality quality_of(const Json& json) {
  Quality q;
  // States that were not finite may have left figures that JSON writes as null.
  const auto number = [&](const char* name) { return json.at(name).is_number() ? json.at(name).get<double>() : 0.0; };
  q.ground_penetration_max = number("ground_penetration_max");
  q.displacement_max = number("displacement_max");
  q.top_drop = number("top_drop");
  q.kinetic_energy_per_body = number("kinetic_energy_per_body");
  q.bodies_below_ground = json.at("bodies_below_ground");
  q.overlap_max = json.value("overlap_max", 0.0);  // absent in files of earlier versions
  q.joint_gap_max = json.value("joint_gap_max", 0.0);
  q.escaped = json.value("escaped", std::uint64_t{0});
  q.non_finite = json.at("non_finite");
  return q;
}

Json to_json(const Circumstances& c) {
  return {{"form", c.form},     {"date", c.date},         {"processor", c.processor},   {"threads", c.threads},
          {"memory", c.memory}, {"system", c.system},     {"devices", c.devices},       {"version", c.version},
          {"commit", c.commit}, {"compiler", c.compiler}, {"build_type", c.build_type}, {"options", c.options},
          {"steps", c.steps}};
}

Circumstances circumstances_of(const Json& json) {
  Circumstances c;
  c.form = json.at("form"), c.date = json.at("date"), c.processor = json.at("processor");
  c.threads = json.at("threads"), c.memory = json.at("memory"), c.system = json.at("system");
  c.devices = json.at("devices").get<std::vector<std::string>>();
  c.version = json.at("version"), c.commit = json.at("commit"), c.compiler = json.at("compiler");
  c.build_type = json.at("build_type"), c.options = json.at("options"), c.steps = json.at("steps");
  return c;
}

Statistics statistics_of(const Json& json) {
  return {json.at("mean"), json.at("median"), json.at("p99"), json.at("max")};
}

Summary summary_of(const Json& run) {
  const Json &stages = run.at("stages_ms"), &spikes = run.at("spikes");
  return {{statistics_of(run.at("step_ms")), statistics_of(stages.at("broad_phase")),
           statistics_of(stages.at("narrow_phase")), statistics_of(stages.at("collision_resolution"))},
          {spikes.at("p99_over_median"), spikes.at("max_over_median")},
          run.at("blocks_ms").get<std::vector<double>>()};
}

Measurement measurement_of(const Json& json) {
  Measurement run;
  Case& c = run.what;
  c.environment = json.at("environment"), c.bodies = json.at("bodies_asked"), c.simulator = json.at("simulator");
  c.device = json.at("device"), c.threads = json.at("threads"), c.set = json.at("set"), c.round = json.at("round");
  run.hardware = json.at("hardware"), run.bodies = json.at("bodies"), run.steps = json.at("steps");
  run.wall_seconds = json.at("wall_seconds"), run.memory_bytes = json.at("memory_bytes");
  run.interruptions = json.at("interruptions");
  run.hash = json.at("state_hash"), run.skipped = json.at("skipped"), run.refused = json.at("refused");
  run.failing = json.at("failing"), run.cut_short = json.at("cut_short");
  if (run.reported()) run.summary = summary_of(json);
  for (const Json& entry : json.at("quality")) run.quality.push_back({entry.at("step"), quality_of(entry)});
  return run;
}

std::string csv_row(const Measurement& run) {
  const Case& c = run.what;
  std::string row = fmt::format("{},{},{},{},{},{},{},{},", c.environment, run.bodies, c.simulator, c.device, c.threads,
                                c.set, c.round, run.steps);
  if (!run.reported() || run.quality.empty())
    return row + fmt::format(",,,,,,,,,,{}\n", run.skipped.empty() ? run.refused : "skipped");
  const StageStatistics& s = run.summary.stages;
  const Spikes& spike = run.summary.spikes;
  const Quality& q = run.end();
  return row + fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{:.3f},{:.3f},{:.6g},{:.6g},{:.6g},{},{}\n", s.total.mean,
                           s.broad_phase.mean, s.narrow_phase.mean, s.collision_resolution.mean, spike.p99, spike.max,
                           q.displacement_max, q.ground_penetration_max, q.kinetic_energy_per_body,
                           q.bodies_below_ground, run.failing);
}

constexpr const char* csv_head =
    "environment,bodies,simulator,device,threads,set,round,steps,step_ms,broad_phase_ms,narrow_phase_ms,"
    "collision_resolution_ms,p99_over_median,max_over_median,displacement_max_m,ground_penetration_max_m,"
    "kinetic_energy_per_body_j,bodies_below_ground,trouble\n";

}  // namespace

Json to_json(const Measurement& run) {
  const Case& c = run.what;
  Json json = {{"key", key_of(c)},
               {"environment", c.environment},
               {"bodies_asked", c.bodies},
               {"bodies", run.bodies},
               {"simulator", c.simulator},
               {"device", c.device},
               {"threads", c.threads},
               {"set", c.set},
               {"round", c.round},
               {"hardware", run.hardware},
               {"steps", run.steps},
               {"wall_seconds", run.wall_seconds},
               {"memory_bytes", run.memory_bytes},
               {"interruptions", run.interruptions},
               {"state_hash", run.hash},
               {"skipped", run.skipped},
               {"refused", run.refused},
               {"failing", run.failing},
               {"cut_short", run.cut_short}};
  if (run.reported()) {
    const StageStatistics& s = run.summary.stages;
    json["step_ms"] = json_of<Json>(s.total);
    json["stages_ms"] = {{"broad_phase", json_of<Json>(s.broad_phase)},
                         {"narrow_phase", json_of<Json>(s.narrow_phase)},
                         {"collision_resolution", json_of<Json>(s.collision_resolution)}};
    const Spikes& spike = run.summary.spikes;
    json["spikes"] = {{"p99_over_median", spike.p99}, {"max_over_median", spike.max}};
    json["blocks_ms"] = run.summary.blocks;
  }
  json["quality"] = Json::array();
  for (const QualitySample& sample : run.quality) {
    Json entry = {{"step", sample.step}};
    entry.update(json_of<Json>(sample.quality));
    json["quality"].push_back(std::move(entry));
  }
  return json;
}

Circumstances circumstances_here() {
  Circumstances c;
  c.date = fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)));
  c.processor = processor_name();
  c.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  c.memory = fmt::format("{:.1f} GiB", static_cast<double>(machine_memory()) / 0x1p30);
  c.system = system_name();
  for (const exec::DeviceInfo& device : exec::list_devices())
    if (device.available && device.backend != exec::Backend::host)
      c.devices.push_back(fmt::format("{}:{} {}", exec::name_of(device.backend), device.index, device.name));
  c.version = build_info::version, c.commit = build_info::commit;
  c.compiler = build_info::compiler, c.build_type = build_info::build_type;
  return c;
}

Store::Store(std::string folder) : folder_(std::move(folder)) {}

std::string Store::path(const std::string& file) const { return (fs::path(folder_) / file).string(); }

bool Store::exists() const { return fs::exists(path("campaign.json")); }

void Store::create() const {
  std::error_code failure;
  fs::create_directories(path("runs"), failure);
  if (failure || !fs::is_directory(path("runs")))
    throw Error(ErrorCode::file, folder_ + ": the folder cannot be created; check its name and permissions");
}

std::unique_ptr<files::OutputFile> Store::claim() const {
  return std::make_unique<files::OutputFile>(path("campaign"));  // never finished: it is removed at the end of the run
}

void Store::write(const std::string& file, const std::string& content) const { files::write_file(path(file), content); }

std::string Store::read(const std::string& file) const {
  return files::read_file(path(file), "give a folder that 'fathom bench campaign' wrote");
}

void Store::save(const Campaign& campaign) const {
  Json json = {{"kind", "campaign"},
               {"format", format},
               {"circumstances", to_json(campaign.where)},
               {"planned", campaign.planned}};
  json["runs"] = Json::array();
  std::string csv = csv_head;
  for (const Measurement& run : campaign.runs) {
    json["runs"].push_back(to_json(run));
    csv += csv_row(run);
  }
  json["pictures"] = Json::array();
  for (const Picture& p : campaign.pictures)
    json["pictures"].push_back(
        {{"environment", p.environment}, {"label", p.label}, {"moment", p.moment}, {"file", p.file}});
  write("campaign.csv", csv);
  write("campaign.json", json.dump(1) + "\n");
}

void Store::save_steps(const Measurement& run) const {
  std::string csv = "step,total_ms,broad_phase_ms,narrow_phase_ms,collision_resolution_ms,pairs,manifolds,points\n";
  for (const Sample& s : run.samples)
    csv += fmt::format("{},{:.6f},{:.6f},{:.6f},{:.6f},{},{},{}\n", s.step, s.total, s.broad_phase, s.narrow_phase,
                       s.collision_resolution, s.pairs, s.manifolds, s.points);
  write("runs/" + key_of(run.what) + ".csv", csv);
}

void Store::load_steps(Measurement& run) const {
  const std::string file = "runs/" + key_of(run.what) + ".csv";
  const std::string text = read(file);
  const char *at = text.data() + std::min(text.size(), text.find('\n') + 1), *end = text.data() + text.size();
  while (at < end) {
    Sample s;
    const auto number = [&](auto& value) {
      const auto [next, error] = std::from_chars(at, end, value);
      if (error != std::errc{} || next == end)
        throw Error(ErrorCode::file, path(file) + ": has a row that is not a step; run it again");
      at = next + 1;
    };
    number(s.step), number(s.total), number(s.broad_phase), number(s.narrow_phase), number(s.collision_resolution);
    number(s.pairs), number(s.manifolds), number(s.points);
    run.samples.push_back(s);
  }
}

Campaign Store::load() const {
  Campaign campaign;
  try {
    const Json json = Json::parse(read("campaign.json"));
    if (json.at("kind") != "campaign" || json.at("format") != format)
      throw Error(ErrorCode::file, path("campaign.json") + ": is of another version; run the campaign again");
    campaign.where = circumstances_of(json.at("circumstances"));
    campaign.planned = json.at("planned");
    for (const Json& entry : json.at("runs")) campaign.runs.push_back(measurement_of(entry));
    for (const Json& p : json.at("pictures"))
      campaign.pictures.push_back({p.at("environment"), p.at("label"), p.at("moment"), p.at("file")});
  } catch (const Json::exception&) {
    throw Error(ErrorCode::file,
                path("campaign.json") + ": is not a campaign; give a folder that 'fathom bench campaign' wrote");
  }
  for (Measurement& run : campaign.runs)
    if (run.reported()) load_steps(run);
  return campaign;
}

}  // namespace fathom::campaign
