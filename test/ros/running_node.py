"""A tissue_sim_node of its own for a test: started with parameters, listened to, stopped."""
import os
import subprocess
import threading
import time

import roslib.packages
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped

SCENES = os.path.join(os.path.dirname(os.path.realpath(__file__)), '..', 'scenes')
SPHERE_SCENE = os.path.realpath(os.path.join(SCENES, 'ros_sphere.yaml'))
POSE_TOPIC = 'test/measured_cp'
# Long runs, as doc/reliability.md has them, instead of the same in seconds.
LONG = os.environ.get('TISSUE_SIM_LONG') == '1'
BALL_RADIUS = 0.03   # m, of the organ in ros_sphere.yaml, around the origin
PROBE_RADIUS = 0.005  # m, of the probe, around its tip


def program(name):
    found = roslib.packages.find_node('tissue_sim', name)
    if not found:
        raise RuntimeError(name + ' is not built, or the devel space is not sourced')
    return found[0]


def wait_until(condition, seconds=15.0):
    """True as soon as the condition holds, False where it never did."""
    end = time.time() + seconds
    while time.time() < end and not rospy.is_shutdown():
        if condition():
            return True
        time.sleep(0.01)
    return bool(condition())


def pose_message(stamp, position, orientation=(0, 0, 0, 1), frame='world'):
    """stamp in whole nanoseconds."""
    message = PoseStamped()
    message.header.stamp = rospy.Time(stamp // 10**9, stamp % 10**9)
    message.header.frame_id = frame
    message.pose.position.x, message.pose.position.y, message.pose.position.z = position
    (message.pose.orientation.x, message.pose.orientation.y, message.pose.orientation.z,
     message.pose.orientation.w) = orientation
    return message


def resident_memory(process):
    """Bytes."""
    with open('/proc/%d/statm' % process.pid) as statm:
        return int(statm.read().split()[1]) * os.sysconf('SC_PAGESIZE')


def stamp_of(message):
    return message.header.stamp.to_nsec()


class RunningNode:
    def __init__(self, name, scene=SPHERE_SCENE, **parameters):
        self.name = '/' + name
        self.received = {}
        self.diagnostics = {}
        self._lock = threading.Lock()
        self._diagnostics_subscriber = rospy.Subscriber('/diagnostics', DiagnosticArray, self._diagnose)
        command = [program('tissue_sim_node'), '__name:=' + name, '_scene:=' + scene]
        command += ['_%s:=%s' % item for item in parameters.items()]
        self.process = subprocess.Popen(command)
        self.poses = rospy.Publisher(POSE_TOPIC, PoseStamped, queue_size=10000)
        # Its first diagnostics say that it is up; the poses' connection comes apart from that.
        if not wait_until(lambda: self.diagnostics) or not wait_until(lambda: self.poses.get_num_connections() > 0):
            raise RuntimeError(name + ' did not start')

    def _diagnose(self, message):
        for status in message.status:
            if status.name.startswith(self.name[1:] + ':'):
                self.diagnostics = {value.key: value.value for value in status.values}

    def listen(self, topic, kind):
        """Collects what comes on a private topic, from now on; returns the list that grows."""
        messages = []
        subscriber = rospy.Subscriber(self.name + '/' + topic, kind, messages.append, queue_size=10000)
        self.received[topic] = subscriber
        assert wait_until(lambda: subscriber.get_num_connections() > 0), topic
        time.sleep(0.2)  # the node hears of its subscriber a little later than the subscriber of the node
        return messages

    def counted(self, key, value, seconds=15.0):
        """Waits until the diagnostics say so."""
        return wait_until(lambda: self.diagnostics.get(key) == str(value), seconds)

    def stop(self):
        for subscriber in self.received.values():
            subscriber.unregister()
        self._diagnostics_subscriber.unregister()
        self.poses.unregister()
        self.process.terminate()
        try:
            self.process.wait(20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise
