// A campaign's folder: campaign.json with everything but the steps, runs/KEY.csv with a row per step, and pictures.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "files/output_file.hpp"
#include "measurement.hpp"

namespace fathom::campaign {

using Json = nlohmann::ordered_json;

/// Where and how a campaign was run.
struct Circumstances {
  std::string form;  ///< quick, full, huge
  std::string date;
  std::string processor;
  int threads = 1;  ///< hardware threads
  std::string memory, system;
  std::vector<std::string> devices;  ///< their names
  std::string version, commit, compiler, build_type;
  std::string options;  ///< options beyond the form
  std::uint64_t steps = 0;
};
Circumstances circumstances_here();

struct Picture {
  std::string environment, label, moment, file;  ///< file: relative to the folder
};

struct Campaign {
  Circumstances where;
  std::size_t planned = 0;  ///< runs
  std::vector<Measurement> runs;
  std::vector<Picture> pictures;
};

class Store {
 public:
  explicit Store(std::string folder);

  const std::string& folder() const { return folder_; }
  std::string path(const std::string& file) const;
  bool exists() const;
  /// Creates the folder. Throws `Error{file}`.
  void create() const;
  /// Reserves the folder for this run while the returned file lives. Throws `Error{file}` if another run has it.
  std::unique_ptr<files::OutputFile> claim() const;
  /// Throws `Error{file}` if there is no valid campaign.
  Campaign load() const;
  /// Writes campaign.json and campaign.csv, a row per run. A reader never sees partial files.
  void save(const Campaign& campaign) const;
  /// Writes a run's steps.
  void save_steps(const Measurement& run) const;
  void write(const std::string& file, const std::string& content) const;
  /// Throws `Error{file}`.
  std::string read(const std::string& file) const;

 private:
  void load_steps(Measurement& run) const;

  std::string folder_;
};

/// Everything about a run but its steps.
Json to_json(const Measurement& run);

}  // namespace fathom::campaign
