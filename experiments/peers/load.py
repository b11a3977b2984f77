"""How busy others keep the cores while something is timed."""
import os
import resource
import time


class Load:
    """How much of the cores others took between start and stop."""

    def __enter__(self):
        self.before = self.read()
        return self

    def __exit__(self, *_):
        wall, busy, own = (after - before for after, before in zip(self.read(), self.before))
        self.others = max(0.0, busy - own) / (wall * os.cpu_count())

    @staticmethod
    def read():
        with open("/proc/stat", encoding="ascii") as file:
            user, nice, system, _, _, irq, softirq = map(int, file.readline().split()[1:8])
        busy = (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")
        own = sum(sum(resource.getrusage(who)[:2]) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
        return time.perf_counter(), busy, own
