# SPDX-License-Identifier: MIT
# In the machine, which has no Python: the simulated segment's SYNC0 edges to lines of gpio-sim.
#
# sim_wire.pl carry PIPE LOG SLAVE=PULL[+PULL]...   each edge of ecdaq-sim --edges PIPE pulls the
#                                                   lines of its slave up and down again
# sim_wire.pl send SOCKET LINE                      send LINE to ecdaq-sim --control SOCKET
use strict;
use warnings;
use Socket;

sub pull {
	my ($file, $direction) = @_;
	sysseek($file, 0, 0);
	defined syswrite($file, $direction) or warn "pull: $!\n";
}

sub carry {
	my ($pipe, $log, @pairs) = @_;
	my %lines_of;
	for my $pair (@pairs) {
		my ($slave, $paths) = split /=/, $pair, 2;
		for my $path (split /\+/, $paths) {
			open my $file, '+<', $path or die "$path: $!\n";
			push @{ $lines_of{$slave} }, $file;
		}
	}
	open my $book, '>', $log or die "$log: $!\n";
	$SIG{TERM} = sub { exit 0 };
	while (1) {
		open my $edges, '<', $pipe or die "$pipe: $!\n";
		while (my $edge = <$edges>) {
			my ($slave, $at_ns, $dc_ns) = split ' ', $edge;
			my $lines = $lines_of{$slave} or next;
			pull($_, 'pull-up') for @$lines;
			pull($_, 'pull-down') for @$lines;
			print $book "$slave $at_ns $dc_ns $at_ns $at_ns\n";
		}
	}
}

sub send_line {
	my ($path, $line) = @_;
	my $mine = "$path.$$";
	umask 0;
	socket my $socket, AF_UNIX, SOCK_DGRAM, 0 or die "socket: $!\n";
	bind $socket, pack_sockaddr_un($mine) or die "$mine: $!\n";
	send $socket, $line, 0, pack_sockaddr_un($path) or die "$path: $!\n";
	recv $socket, my $answer, 4096, 0 // die "$path: $!\n";
	unlink $mine;
	print "$answer\n";
}

my $what = shift // '';
$what eq 'carry' ? carry(@ARGV) : $what eq 'send' ? send_line(@ARGV) : die "carry or send\n";
