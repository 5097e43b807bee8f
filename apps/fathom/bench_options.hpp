// Options of `fathom bench`.
#pragma once

#include <string>
#include <vector>

#include "bench/campaign/campaign.hpp"
#include "bench/campaign/compare.hpp"
#include "bench/peers/peers_command.hpp"

namespace CLI {
class App;
}

namespace fathom::cli {

struct CampaignOptions {
  campaign::Settings settings;
  std::string out = "fathom-campaign";
  bool quiet = false;
};

struct CompareOptions {
  std::string before, after;
  campaign::CompareSettings settings;
};

struct PeersOptions {
  peers::Options peers;
  std::string out = "fathom-campaign";
};

struct BenchOptions {
  CampaignOptions campaign;
  PeersOptions peers;
  CompareOptions compare;
  std::string report_folder;
  const CLI::App* campaign_command = nullptr;
  const CLI::App* peers_command = nullptr;
  const CLI::App* compare_command = nullptr;
  const CLI::App* report_command = nullptr;
};

/// Declares `bench` with its own subcommands.
void declare_bench(CLI::App& command, BenchOptions& options);

}  // namespace fathom::cli
