#include <fmt/format.h>

#include "commands.hpp"
#include "files/input_file.hpp"
#include "report.hpp"

namespace fathom::cli {
namespace {

Json read_report(const std::string& path) {
  const std::string text = files::read_file(path, "give files written by 'fathom run --json'");
  try {
    return Json::parse(text);
  } catch (const Json::exception&) {
    throw Error(ErrorCode::file, path + ": is not JSON; give files written by 'fathom run --json'");
  }
}

std::string row(const Json& r) {
  const Json& time = r.at("step_ms");
  const Json& quality = r.at("quality");
  return fmt::format("{:<12}{:>9}{:>8}{:>7}", r.at("environment").get<std::string>(),
                     r.at("bodies").get<std::uint64_t>(), r.at("threads").get<int>(),
                     r.at("steps").get<std::uint64_t>()) +
         fmt::format("{:>10.3f}{:>9.3f}{:>9.3f}", time.at("mean").get<double>(), time.at("p99").get<double>(),
                     time.at("max").get<double>()) +
         fmt::format("{:>8}{:>9.3f}{:>9.4f}{:>10.2g}\n", r.at("counts").at("points").get<std::uint64_t>(),
                     1e3 * quality.at("ground_penetration_max").get<double>(),
                     quality.at("displacement_max").get<double>(), quality.at("kinetic_energy_per_body").get<double>());
}

}  // namespace

int table(const TableOptions& options) {
  std::string rows;
  for (const std::string& file : options.files) {
    try {
      rows += row(read_report(file));
    } catch (const Json::exception&) {
      throw Error(ErrorCode::file, file + ": is not a result of 'fathom run --json'; write it again");
    }
  }
  fmt::print("{:<12}{:>9}{:>8}{:>7}{:>10}{:>9}{:>9}{:>8}{:>9}{:>9}{:>10}\n{}", "environment", "bodies", "threads",
             "steps", "mean ms", "p99 ms", "max ms", "points", "sunk mm", "moved m", "J per body", rows);
  return finished;
}

}  // namespace fathom::cli
