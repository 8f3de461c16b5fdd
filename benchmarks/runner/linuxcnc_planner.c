/* LinuxCNC's own trajectory planner, the module tpmod.so of its package, run without a machine.
 *
 *     gcc -O2 -DRTAPI -DUSPACE -I/usr/include/linuxcnc linuxcnc_planner.c -o linuxcnc_planner -rdynamic -ldl -lm
 *     linuxcnc_planner TPMOD < records > positions
 *
 * Records are lines of a word and numbers in mm and s, and stand in the order of the program:
 *
 *     machine period vx vy vz ax ay az        the first one: servo period, limits of the axes
 *     start x y z                             the second one
 *     ends condition tolerance                of the moves after it: 0 at rest, 1 on the path, 2 rounded within the tolerance
 *     line x y z kind feed top acceleration   kind as in emc/nml_intf/motion_types.h: 1 rapid, 2 feed
 *     arc x y z cx cy cz nx ny nz turns feed top acceleration
 *     rest periods                            wait until the motion has ended, and then so many servo periods
 *
 * Positions are doubles, x y z of each servo period from the start on. The parameters of the blends are LinuxCNC's defaults
 * (emc/ini/inihal.cc). Exit code 1 and a line on stderr for a record that is none, or that the planner refuses.
 */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "rtapi.h"
#include "posemath.h"
#include "motion.h"
#include "motion_types.h"
#include "tp.h"
#include "tcq.h"

#define CYCLES_MAX 20000000L /* of a program that never ends: more than five hours at 1 ms */

/* ---- what the module asks of its host ------------------------------------------------------------------------------------- */
int hal_init(const char *name) { (void)name; return 1; }
int hal_exit(int component) { (void)component; return 0; }
int hal_ready(int component) { (void)component; return 0; }
void rtapi_print(const char *format, ...) { (void)format; }
void rtapi_print_msg(msg_level_t level, const char *format, ...)
{
    va_list given;
    if (level > RTAPI_MSG_ERR)
        return;
    va_start(given, format);
    vfprintf(stderr, format, given);
    va_end(given);
}

static double velocity[3], acceleration[3];
static double axis_velocity(int axis) { return axis < 3 ? velocity[axis] : 0.0; }
static double axis_acceleration(int axis) { return axis < 3 ? acceleration[axis] : 0.0; }
static void digital(int pin, char value) { (void)pin; (void)value; }
static void analog(int pin, double value) { (void)pin; (void)value; }
static void unlock(int joint, int value) { (void)joint; (void)value; }
static int unlocked(int joint) { (void)joint; return 1; }

/* ---- the planner ---------------------------------------------------------------------------------------------------------- */
static emcmot_status_t status;
static emcmot_config_t config;
static TP_STRUCT tp;
static double period;
static long cycles;

static void fail(const char *what, const char *said)
{
    fprintf(stderr, "%s: %s\n", what, said);
    exit(1);
}

static void *symbol(void *module, const char *name)
{
    void *found = dlsym(module, name);
    if (!found)
        fail(name, "not in the module");
    return found;
}
#define CALLED(name) static __typeof__(name) *p_##name
#define FIND(name) p_##name = (__typeof__(name) *)symbol(module, #name)
CALLED(tpMotFunctions); CALLED(tpMotData); CALLED(tpCreate); CALLED(tpSetCycleTime); CALLED(tpSetPos); CALLED(tpSetVmax);
CALLED(tpSetVlimit); CALLED(tpSetAmax); CALLED(tpSetId); CALLED(tpSetTermCond); CALLED(tpAddLine); CALLED(tpAddCircle);
CALLED(tpRunCycle); CALLED(tpGetPos); CALLED(tpIsDone); CALLED(tcqFull);

static void put(void)
{
    EmcPose at;
    p_tpGetPos(&tp, &at);
    double row[3] = {at.tran.x, at.tran.y, at.tran.z};
    if (fwrite(row, sizeof row, 1, stdout) != 1)
        fail("positions", "cannot be written");
}

static void cycle(void)
{
    if (++cycles > CYCLES_MAX)
        fail("program", "does not end");
    p_tpRunCycle(&tp, (long)(period * 1e9 + 0.5));
    put();
}

static void begin(const char *path, const char *machine, const char *start)
{
    double top = 0.0, least = 0.0;
    EmcPose at;
    if (sscanf(machine, "machine %lf %lf %lf %lf %lf %lf %lf", &period, velocity, velocity + 1, velocity + 2, acceleration,
               acceleration + 1, acceleration + 2) != 7)
        fail("no machine", machine);
    memset(&at, 0, sizeof at);
    if (sscanf(start, "start %lf %lf %lf", &at.tran.x, &at.tran.y, &at.tran.z) != 3)
        fail("no start", start);
    void *module = dlopen(path, RTLD_NOW | RTLD_GLOBAL);
    if (!module)
        fail("module", dlerror());
    FIND(tpMotFunctions); FIND(tpMotData); FIND(tpCreate); FIND(tpSetCycleTime); FIND(tpSetPos); FIND(tpSetVmax);
    FIND(tpSetVlimit); FIND(tpSetAmax); FIND(tpSetId); FIND(tpSetTermCond); FIND(tpAddLine); FIND(tpAddCircle);
    FIND(tpRunCycle); FIND(tpGetPos); FIND(tpIsDone); FIND(tcqFull);

    status.net_feed_scale = 1.0;
    config.arcBlendEnable = 1;
    config.arcBlendOptDepth = 50;
    config.arcBlendGapCycles = 4;
    config.arcBlendRampFreq = 100.0;
    config.arcBlendTangentKinkRatio = 0.1;
    config.maxFeedScale = 1.0;
    config.numDIO = config.numAIO = 4;
    config.numSpindles = 1;
    for (int axis = 0; axis < 3; axis++) {
        top += velocity[axis];
        least = axis == 0 || acceleration[axis] < least ? acceleration[axis] : least;
    }
    p_tpMotFunctions(digital, analog, unlock, unlocked, axis_velocity, axis_acceleration);
    p_tpMotData(&status, &config);
    if (p_tpCreate(&tp, DEFAULT_TC_QUEUE_SIZE, 1))
        fail("planner", "cannot be made");
    p_tpSetCycleTime(&tp, period);
    p_tpSetPos(&tp, &at);
    p_tpSetVmax(&tp, top, top);
    p_tpSetVlimit(&tp, top);
    p_tpSetAmax(&tp, least);
    put();
}

/* One record; the number of the move for the planner. */
static void give(const char *record, int number)
{
    EmcPose end;
    PmCartesian center, normal;
    struct state_tag_t tag;
    double feed, top, most, tolerance;
    int kind, turns, condition, result = 0;
    long periods;
    memset(&end, 0, sizeof end);
    memset(&tag, 0, sizeof tag);
    p_tpSetId(&tp, number);
    if (sscanf(record, "ends %d %lf", &condition, &tolerance) == 2)
        p_tpSetTermCond(&tp, condition, tolerance);
    else if (sscanf(record, "line %lf %lf %lf %d %lf %lf %lf", &end.tran.x, &end.tran.y, &end.tran.z, &kind, &feed, &top,
                    &most) == 7)
        result = p_tpAddLine(&tp, end, kind, feed, top, most, 0, 0, -1, tag);
    else if (sscanf(record, "arc %lf %lf %lf %lf %lf %lf %lf %lf %lf %d %lf %lf %lf", &end.tran.x, &end.tran.y, &end.tran.z,
                    &center.x, &center.y, &center.z, &normal.x, &normal.y, &normal.z, &turns, &feed, &top, &most) == 13)
        result = p_tpAddCircle(&tp, end, center, normal, turns, EMC_MOTION_TYPE_ARC, feed, top, most, 0, 0, tag);
    else if (sscanf(record, "rest %ld", &periods) == 1) {
        while (!p_tpIsDone(&tp))
            cycle();
        while (periods-- > 0)
            put();
    } else
        fail("no record", record);
    if (result < 0) /* above 0: of no length, left out */
        fail("refused by LinuxCNC's planner", record);
}

int main(int argc, char **argv)
{
    char *line = NULL, *first = NULL;
    size_t room = 0, room_first = 0;
    int number = 0, more;
    if (argc != 2 || getline(&first, &room_first, stdin) < 0 || getline(&line, &room, stdin) < 0)
        fail("usage", "linuxcnc_planner TPMOD < records > positions");
    begin(argv[1], first, line);
    more = getline(&line, &room, stdin) >= 0;
    while (more || !p_tpIsDone(&tp)) {
        while (more && !p_tcqFull(&tp.queue)) {
            give(line, ++number);
            more = getline(&line, &room, stdin) >= 0;
        }
        cycle();
    }
    return 0;
}
