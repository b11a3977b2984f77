#include "experiments/commands/report.hpp"

#include <cstdio>

#include "experiments/applications/run_folder.hpp"
#include "experiments/applications/run_report.hpp"
#include "experiments/commands/cli.hpp"
#include "experiments/studies/run_directory_report.hpp"
#include "host/report/run_directory.hpp"

namespace clerestory {

void add_report_command(CommandLine& line) {
  const auto run = std::make_shared<std::filesystem::path>();
  line.add("report", "Make report.html again from the files of a run, with what was made from it")
      .argument("RUN",
                "A folder that `invert`, `edit`, `train` or `run` made; a sweep has its report.html beside its tables",
                *run)
      .common({Common::Quiet})
      .notes("Prints where the report lies.")
      .run([run](const CommonOptions&) {
        if (is_run_directory(*run)) {
          const FileLock lock(RunDirectory::lock_of(*run), LockKind::Write, *run);
          write_run_directory_report(*run);
        } else {
          const FolderLock lock = lock_run(*run, LockKind::Write);
          if (!std::filesystem::exists(*run / kProvenanceName))
            throw usage_error(fmt::format("is no run: it has no {}", kProvenanceName), run->string());
          write_run_report(*run);
        }
        std::printf("%s\n", (*run / "report.html").c_str());
      });
}

}  // namespace clerestory
